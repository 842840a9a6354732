import { useEffect, useRef } from "preact/hooks";
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";

// A plot of lines over time or frequency.

export interface Line {
  name: string;
  unit: string;
  colour: string;
}

export interface Marks {
  a: number | null;
  b: number | null;
}

const kHeight = 420;

function colourOf(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Errors are small beside the places of which they are. */
const scaleOf = (line: Line) => (line.unit || "-") + (line.name.endsWith("following_error") ? " behind" : "");

const isDecade = (value: number | null) => !!value && Number.isInteger(Math.round(1e6 * Math.log10(value)) / 1e6);
const decadeText = (value: number | null) => (isDecade(value) ? String(Number(value!.toPrecision(1))) : "");
/** Lines and marks of an axis of decades. */
const decadesOnly = (_: uPlot, at: number[]) => at.map((value) => (isDecade(value) ? value : null));

/** Lines of one scale share an axis: the first on the left, the second on the right; the others have none. */
function options(lines: Line[], width: number, height: number, xText: string, marks: () => Marks, pick: (x: number) => void,
  zoomed: (on: boolean) => void, decades: boolean): uPlot.Options {
  const scales = [...new Set(lines.map(scaleOf))];
  const [soft, grid] = [colourOf("--soft"), colourOf("--edge")];
  const axis = { stroke: soft, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font: "12px 'Inter Variable'" };
  return {
    width, height,
    scales: { x: { time: false }, ...Object.fromEntries(scales.map((scale) => [scale, decades ? { distr: 3, log: 10 } : {}])) },
    series: [{ label: xText, value: (_, x) => (x === null ? "" : x.toPrecision(6)) },
      ...lines.map((line) => ({
        label: line.name, scale: scaleOf(line), stroke: line.colour, width: 1.5, spanGaps: false,
        value: (_: uPlot, y: number | null) => (y === null ? "" : `${Number(y.toPrecision(7))} ${line.unit}`),
      }))],
    axes: [{ ...axis, label: xText, labelSize: 18, labelFont: "12px 'Inter Variable'" },
      ...scales.slice(0, 2).map((scale, i) => ({
        ...axis, scale, side: i ? 1 : 3, size: 64, ...(decades && { values: (_: uPlot, at: (number | null)[]) => at.map(decadeText) }), label: scale === "-" ? "" : scale, labelSize: 16, labelFont: "12px 'Inter Variable'",
        grid: { show: i === 0, stroke: grid, width: 1, ...(decades && { filter: decadesOnly }) },
        ticks: { ...axis.ticks, ...(decades && { filter: decadesOnly }) },
      }))],
    cursor: { drag: { x: true, y: false } },
    hooks: {
      draw: [(plot) => drawMarks(plot, marks())],
      ready: [(plot) => {
        let from = 0;
        plot.over.addEventListener("pointerdown", (event) => { from = event.clientX; });
        // A drag zooms.
        plot.over.addEventListener("click", (event) => {
          if (Math.abs(event.clientX - from) < 3) pick(plot.posToVal(event.offsetX, "x"));
        });
        plot.over.addEventListener("dblclick", () => zoomed(false));
      }],
      setSelect: [(plot) => zoomed(plot.select.width >= 2)],
    },
  };
}

function drawMarks(plot: uPlot, { a, b }: Marks) {
  const context = plot.ctx;
  for (const [name, x] of [["A", a], ["B", b]] as const) {
    if (x === null) continue;
    const at = plot.valToPos(x, "x", true);
    context.save();
    context.strokeStyle = context.fillStyle = colourOf("--waits");
    context.setLineDash([6, 4]);
    context.beginPath();
    context.moveTo(at, plot.bbox.top);
    context.lineTo(at, plot.bbox.top + plot.bbox.height);
    context.stroke();
    context.font = `${13 * devicePixelRatio}px sans-serif`;
    context.fillText(name, at + 4, plot.bbox.top + 14 * devicePixelRatio);
    context.restore();
  }
}

/** `again` changes where the plot is to be made anew, as for another theme. */
export function Plot({ lines, data, xText, marks, pick, zoomed, again, log, decades = false }: {
  lines: Line[]; data: (number | null)[][]; xText: string; marks: Marks; pick: (x: number) => void;
  zoomed: (on: boolean) => void; again: string; log?: string; decades?: boolean;
}) {
  const host = useRef<HTMLDivElement>(null);
  const plot = useRef<uPlot | null>(null);
  const now = useRef({ marks, pick, zoomed });
  now.current = { marks, pick, zoomed };
  useEffect(() => {
    const element = host.current!;
    const size = () => ({ width: element.clientWidth, height: Math.max(220, (element.clientHeight || kHeight) - 44) });
    const first = size();
    plot.current = new uPlot(options(lines, first.width, first.height, xText, () => now.current.marks,
      (x) => now.current.pick(x), (on) => now.current.zoomed(on), decades), data as uPlot.AlignedData, element);
    const watch = new ResizeObserver(() => plot.current?.setSize(size()));
    watch.observe(element);
    return () => {
      watch.disconnect();
      plot.current?.destroy();
    };
  }, [lines.map((line) => line.name + line.unit).join(), xText, again, decades]);
  useEffect(() => plot.current?.setData(data as uPlot.AlignedData), [data, log]);
  useEffect(() => {
    // Without any place on its axes a plot cannot be drawn again.
    if (plot.current?.scales.x.min != null) plot.current.redraw(false);
  }, [marks.a, marks.b]);
  return <div class="plot" ref={host} data-test="plot" />;
}
