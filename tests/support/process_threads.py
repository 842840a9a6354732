"""What the threads of a process are at, for one that does not end."""
import pathlib


def threads_of(process):
    """Name, state and what it waits for of each thread, a line each."""
    lines = []
    for task in sorted(pathlib.Path(f"/proc/{process}/task").iterdir()):
        state = (task / "stat").read_text().rsplit(")", 1)[1].split()
        name = (task / "comm").read_text().strip()
        lines.append(f"{name}: {state[0]}, {state[11]} + {state[12]} clock ticks of CPU, "
                     f"waits in {(task / 'wchan').read_text()}")
    return "\n".join(lines)
