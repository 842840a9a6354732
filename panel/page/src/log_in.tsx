import { useState } from "preact/hooks";
import { link, useLink } from "./link";

// Where the panel is reached over a network, its users log in.

export function LogIn() {
  const { machine } = useLink("link", "machine");
  const [text, setText] = useState("");
  const [busy, setBusy] = useState(false);
  const submit = async (event: Event) => {
    event.preventDefault();
    const form = event.currentTarget as HTMLFormElement;
    const said = new FormData(form);
    setBusy(true);
    const why = await link.logIn(String(said.get("name")), String(said.get("password")));
    setBusy(false);
    setText(why);
    if (why) (form.elements.namedItem("password") as HTMLInputElement).select();
  };
  return (
    <main class="log-in">
      <form class="card" onSubmit={(event) => void submit(event)} data-test="log-in">
        <img src="./icon.svg" alt="" width="56" height="56" />
        <h1>{machine?.name ?? "Trunnion"}</h1>
        <p class="hint">{link.sessionOver || "Log in to see the machine and to operate it."}</p>
        <label>Name<input name="name" autocomplete="username" required autofocus autocapitalize="none" /></label>
        <label>Password<input name="password" type="password" autocomplete="current-password" required /></label>
        <p class="wrong" role="alert" data-test="log-in-text">{text}</p>
        <button class="large accent" disabled={busy}>{busy ? "One moment" : "Log in"}</button>
      </form>
    </main>
  );
}

const kRoles: Record<string, string> = { look: "may look and stop", operate: "may operate", "set up": "may operate and set up" };

/** Who is logged in; nothing where a key opens the page. */
export function User() {
  const { user } = useLink("link");
  if (!user) return null;
  return (
    <span class="user" data-test="user">
      <span><b>{user.name}</b><small>{kRoles[user.role] ?? user.role}</small></span>
      <button onClick={() => void link.logOut()} data-test="log-out">Log out</button>
    </span>
  );
}
