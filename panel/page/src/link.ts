import { useEffect, useState } from "preact/hooks";
import type {
  Alarm, Answer as Told, Command as Asked, Controls, Fleet, LogEntry, Machine, Motion, PageMessage, PlanState, ProgramFile, ScopeData,
  ScopeSignals, ServerMessage,
  Session, Status, Tables,
} from "./interface";
import { isProgram } from "./model";
import { Plan } from "./plan";
import { ProgramText } from "./program_text";

// The page's one line to the server, and all it knows from there.

/** Of a command; one that never came has no status. */
export type Answer = Pick<Told, "outcome" | "text"> & Partial<Told>;
export type Command = Omit<Asked, "id">;

const kNoControls: Controls = { page: 0, mine: false, holder: 0, holder_name: "", asker: 0, asker_name: "", may_take: false };

const kAliveMs = 250;
const kHoldKey = "hold-when-lost";
const kReconnectMs = 1000;
const kLogMax = 500;
const kSameUs = 2e6;
const kScopeMs = 1500;
const kLookMs = 250;
const kStaleMs = 2500;
const kGiveUpMs = 8000;
/** A name under which the panel keeps a program that is sent. */
const kSendable = /^[A-Za-z0-9 _-][A-Za-z0-9 ._-]*$/;
/** An answer that has not come by then is not waited for any longer; the state tells what happened. */
const kAnswerMs = 15000;

const kNoVisitor = 4401;
const kKeyName = "key";
const kNoKeyText = "This page has no key: open the address that 'trunnion panel' printed.";

/**
 * The key that opens the panel: from the address, out of which it goes at once, or what this tab had before. "": none.
 */
function takeKey(): string {
  const found = new URLSearchParams(location.hash.slice(1)).get(kKeyName);
  if (found) {
    sessionStorage.setItem(kKeyName, found);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem(kKeyName) ?? "";
}

type Topic = "fleet" | "status" | "motion" | "tables" | "alarms" | "log" | "link" | "machine" | "programs" | "program" | "plan";

export class Link {
  machine: Machine | null = null;
  status: Status | null = null;
  motion: Motion | null = null;
  tables: Tables | null = null;
  alarms: Alarm[] = [];
  /** Every machine that the LCM network shows. */
  fleet: Fleet = { machines: [], silent: "" };
  log: LogEntry[] = [];
  programs: ProgramFile[] = [];
  /** The text of the program that was loaded last. */
  program: ProgramText | null = null;
  private programOf = "";
  /** How the plan of that program stands, and the plan once it is there. */
  planState: PlanState = { state: "none", program: "", text: "", number: 0 };
  plan: Plan | null = null;
  /** The page's connection to the server stands. */
  connected = false;
  /** The connection stands, and nothing has come over it for too long: what is shown is old. */
  stale = false;
  private heard = 0;
  /** Why no daemon is heard; "" while it is. */
  gone = "";
  /** Why the server has nothing to do with this page; "" while it has. */
  refused = "";
  /** Who has logged in; null where a key opens the page. */
  user: Session | null = null;
  /** The page shall ask for name and password. */
  needsLogIn = false;
  /** Why it asks again; "" at first. */
  sessionOver = "";
  controls: Controls = kNoControls;
  /** What is shown is of before: nobody says what the machine does now. */
  get old() { return !this.connected || this.stale || this.gone !== ""; }
  /** This page has the controls, of a machine that is heard. */
  get mine() { return this.controls.mine && !this.old; }

  private key = "";
  private socket: WebSocket | null = null;
  private lastId = 0;
  private readonly answers = new Map<number, (answer: Answer) => void>();
  private readonly scopes = new Map<number, (answer: ScopeSignals | ScopeData | null) => void>();
  private readonly listeners = new Map<Topic, Set<() => void>>();
  private aliveTimer = 0;
  /** This page's wish: a program holds when the page is lost. */
  holdWhenLost = localStorage.getItem(kHoldKey) === "1";

  start() {
    this.key = takeKey();
    // An address with another key is the same page to the browser, which does not load it again.
    window.addEventListener("hashchange", () => {
      this.key = takeKey();
      if (this.refused) void this.connect();
    });
    void this.connect();
    window.setInterval(() => this.watchSilence(), kLookMs);
  }

  /** The panel says something every second. A network that is cut leaves the connection as it is for minutes. */
  private watchSilence() {
    const silent = this.connected ? performance.now() - this.heard : 0;
    if (silent > kGiveUpMs) this.socket?.close();
    if (silent > kGiveUpMs) this.closed("");
    if (silent > kStaleMs === this.stale) return;
    this.stale = silent > kStaleMs;
    this.tell("link");
  }

  /** Whether this page may open the stream: by its key, or as somebody who has logged in. */
  private async mayConnect(): Promise<boolean> {
    this.refused = "";
    if (this.key) return true;
    const answer = await fetch("api/v1/session").catch(() => null);
    const session: Session | null = answer?.ok ? await answer.json().catch(() => null) : null;
    if (!session) window.setTimeout(() => void this.connect(), kReconnectMs);
    if (!session?.log_in) {
      this.refused = session ? kNoKeyText : "";
      return false;
    }
    this.needsLogIn = session.name === "";
    this.user = this.needsLogIn ? null : session;
    return !this.needsLogIn;
  }

  async logIn(name: string, password: string): Promise<string> {
    const body = JSON.stringify({ name, password });
    const answer = await fetch("api/v1/log_in", { method: "POST", body }).catch(() => null);
    if (!answer?.ok) return answer ? (await answer.text()).trim() : "The panel does not answer.";
    this.sessionOver = "";
    void this.connect();
    return "";
  }

  async logOut() {
    await fetch("api/v1/log_out", { method: "POST" }).catch(() => null);
    this.sessionOver = "You have logged out.";
  }

  private async connect() {
    const may = await this.mayConnect();
    this.tell("link");
    if (!may) return;
    const url = new URL("api/v1/stream", location.href);
    url.protocol = url.protocol.replace("http", "ws");
    const socket = new WebSocket(url, "trunnion-1");
    this.socket = socket;
    socket.onopen = () => {
      if (this.key) socket.send(JSON.stringify({ type: "key", key: this.key }));
    };
    socket.onmessage = (event) => {
      if (this.socket === socket) this.receive(JSON.parse(event.data as string) as ServerMessage);
    };
    socket.onclose = (event) => {
      if (this.socket === socket) this.closed(event.code === kNoVisitor ? event.reason : "");
    };
  }

  on(topic: Topic, listener: () => void): () => void {
    const all = this.listeners.get(topic) ?? new Set();
    this.listeners.set(topic, all);
    all.add(listener);
    return () => all.delete(listener);
  }

  /** Takes the controls, or asks who has them. */
  takeControls() {
    this.send({ type: "take_controls" });
  }

  /** To who asks for them, or to nobody. */
  giveControls() {
    this.send({ type: "give_controls" });
  }

  keepControls() {
    this.send({ type: "keep_controls" });
  }

  /** Signals of past periods, or without signals the list of them; null where no answer came. */
  async scope(signals: string[], from: number, rows: number): Promise<ScopeSignals | ScopeData | null> {
    if (!this.connected) return null;
    const id = ++this.lastId;
    return new Promise((resolve) => {
      const timer = window.setTimeout(() => done(null), kScopeMs);
      const done = (answer: ScopeSignals | ScopeData | null) => {
        window.clearTimeout(timer);
        this.scopes.delete(id);
        resolve(answer);
      };
      this.scopes.set(id, done);
      this.send({ type: "scope", id, signals, from, rows });
    });
  }

  /** Sends a command; what is refused, or not answered, is also put into the log. */
  async command(command: Command): Promise<Answer> {
    const always = ["estop", "stop", "hold"].includes(command.verb);
    if (!this.connected || (this.stale && !always))
      return this.noted(command, { outcome: "unreachable", text: "No connection to the panel." });
    const id = ++this.lastId;
    const answer = await new Promise<Answer>((resolve) => {
      const timer = window.setTimeout(() => {
        this.answers.delete(id);
        resolve({ outcome: "unreachable", text: "No answer came." });
      }, kAnswerMs);
      this.answers.set(id, (got) => {
        window.clearTimeout(timer);
        resolve(got);
      });
      this.send({ type: "command", id, ...command });
    });
    if (command.verb === "load" && answer.outcome === "accepted") void this.fetchProgram();
    if (command.verb === "load" && answer.outcome === "bad_program") void this.fetchRefused(command.text ?? "", answer.text);
    return this.noted(command, answer);
  }

  /** The server is told every so many ms that somebody is there; it stops a jog when that ceases. 0: nobody jogs. */
  setAlive(everyMs: number) {
    window.clearInterval(this.aliveTimer);
    this.aliveTimer = 0;
    const every = everyMs || (this.holdWhenLost && this.controls.mine ? kAliveMs : 0);
    if (!every) return;
    this.send({ type: "alive" });
    this.aliveTimer = window.setInterval(() => this.send({ type: "alive" }), every);
  }

  setHoldWhenLost(on: boolean) {
    this.holdWhenLost = on;
    localStorage.setItem(kHoldKey, on ? "1" : "0");
    this.send({ type: "hold_when_lost", on });
    this.setAlive(0);
    this.tell("link");
  }

  private noted(command: Command, answer: Answer): Answer {
    if (answer.outcome !== "accepted") {
      const what = command.verb.replace(/_/g, " ");
      const why = answer.text || answer.outcome.replace("_", " ");
      this.note({ time_us: Date.now() * 1000, kind: "refused", text: `${what}: ${why}` });
    }
    return answer;
  }

  /** A line of this page's own in the log. */
  say(text: string) {
    this.note({ time_us: Date.now() * 1000, kind: "message", text });
  }

  private note(entry: LogEntry) {
    // A refusal comes as the answer and as the machine's message: once is enough.
    const told = this.log.slice(-4).find((other) => Math.abs(other.time_us - entry.time_us) < kSameUs &&
      (other.text.includes(entry.text) || entry.text.includes(other.text)));
    if (told) return;
    this.log = [...this.log, entry].slice(-kLogMax);
    this.tell("log");
  }

  private send(message: PageMessage) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private tell(topic: Topic) {
    this.listeners.get(topic)?.forEach((listener) => listener());
  }

  private closed(refused: string) {
    this.socket = null;
    this.stale = false;
    this.refused = this.key ? refused : "";
    if (refused && !this.key && !this.sessionOver) this.sessionOver = refused;
    this.connected = false;
    this.controls = kNoControls;
    this.setAlive(0);
    for (const answer of this.answers.values()) answer({ outcome: "unreachable", text: "The connection was lost." });
    this.answers.clear();
    this.tell("link");
    if (!this.refused) window.setTimeout(() => void this.connect(), refused ? 0 : kReconnectMs);
  }

  private receive(message: ServerMessage) {
    this.heard = performance.now();
    if (this.stale) this.watchSilence();
    switch (message.type) {
      case "hello":
        this.connected = true;
        if (this.holdWhenLost) this.send({ type: "hold_when_lost", on: true });
        void this.fetchMachine();
        void this.fetchHistory();
        void this.fetchPrograms();
        return this.tell("link");
      case "status":
        this.status = message;
        if (isProgram(message.program) && message.program !== this.programOf) void this.fetchProgram();
        // The axes are known to the server only once the daemon has spoken.
        if (this.machine && !this.machine.axes) void this.fetchMachine();
        if (this.gone) {
          this.gone = "";
          this.tell("link");
        }
        return this.tell("status");
      case "motion":
        this.motion = message;
        return this.tell("motion");
      case "plan":
        this.planState = message;
        if (message.state === "ready") return void this.fetchPlan(message.number);
        this.plan = null;
        return this.tell("plan");
      case "tables":
        this.tables = message;
        return this.tell("tables");
      case "alarms":
        this.alarms = message.alarms;
        return this.tell("alarms");
      case "fleet":
        this.fleet = message;
        return this.tell("fleet");
      case "message":
        return this.note(message);
      case "error":
        return this.note({ time_us: Date.now() * 1000, kind: "error", text: message.text });
      case "gone":
        this.gone = message.text;
        return this.tell("link");
      case "controls":
        // Somebody who only asks ends no move by hand.
        if (message.mine !== this.controls.mine) {
          this.controls = message;
          this.setAlive(0);
        }
        this.controls = message;
        return this.tell("link");
      case "scope_signals":
      case "scope_data":
        return this.scopes.get(Number(message.id))?.(message);
      case "answer":
        this.answers.get(Number(message.id))?.(message);
        this.answers.delete(Number(message.id));
    }
  }

  /** What GET answers; null where nothing came. */
  async fetch(name: string): Promise<Response | null> {
    const headers = { Authorization: `Bearer ${this.key}` };
    const answer = await fetch(`api/v1/${name}`, { headers }).catch(() => null);
    return answer?.ok ? answer : null;
  }

  private async get(name: string): Promise<any> {
    return (await this.fetch(name))?.json() ?? null;
  }

  private async fetchPlan(number: number) {
    const answer = await this.fetch("plan");
    const bytes = await answer?.arrayBuffer().catch(() => undefined);
    if (this.planState.number !== number) return;
    this.plan = bytes ? new Plan(bytes) : null;
    this.tell("plan");
  }

  /** The text of a program that was not loaded, with what is wrong in it. */
  private async fetchRefused(name: string, error: string) {
    const answer = await this.fetch(`programs/${name.split("/").map(encodeURIComponent).join("/")}`);
    if (!answer) return;
    this.program = new ProgramText(name, await answer.text(), error);
    this.tell("program");
  }

  private async fetchProgram() {
    const path = this.status!.program;
    this.programOf = path;
    const answer = await this.fetch("program");
    const text = answer ? await answer.text() : "";
    if (this.programOf === path) this.program = new ProgramText(path, text);
    this.tell("program");
  }

  /** Puts a program into the panel's folder; "" where that worked, else why not. */
  async upload(file: File): Promise<string> {
    if (!kSendable.test(file.name))
      return this.unsent(`“${file.name}” is not sent. The name of a program that is sent has only letters from a to z, digits, ` +
        "spaces and . _ -: give the file another name.");
    const headers = { Authorization: `Bearer ${this.key}` };
    const answer = await fetch(`api/v1/programs/${encodeURIComponent(file.name)}`, { method: "POST", headers, body: file })
      .catch(() => null);
    void this.fetchPrograms();
    if (answer?.ok) return "";
    return this.unsent((await answer?.text().catch(() => ""))?.trim() || "The program could not be sent.");
  }

  private unsent(why: string): string {
    this.note({ time_us: Date.now() * 1000, kind: "refused", text: `upload: ${why}` });
    return why;
  }

  private async fetchMachine() {
    const machine = await this.get("machine");
    if (!machine) return;
    this.machine = machine;
    this.tell("machine");
  }

  /** Asks for the programs of the panel's folder anew. */
  async fetchPrograms() {
    this.programs = (await this.get("programs")) ?? [];
    this.tell("programs");
  }

  private async fetchHistory() {
    const before: LogEntry[] | null = await this.get("history");
    if (!before) return;
    // What arrived over the socket meanwhile is in the history too.
    const own = this.log.filter((entry) => !before.some((b) => b.time_us === entry.time_us && b.text === entry.text));
    this.log = [...before, ...own].sort((a, b) => a.time_us - b.time_us).slice(-kLogMax);
    this.tell("log");
  }
}

export const link = new Link();

/** Draws the component again whenever one of the topics has news. */
export function useLink(...topics: Topic[]): Link {
  const [, draw] = useState(0);
  useEffect(() => {
    const again = () => draw((count) => count + 1);
    const ends = topics.map((topic) => link.on(topic, again));
    // What came between the first drawing and this would never be seen.
    again();
    return () => ends.forEach((end) => end());
  }, []);
  return link;
}
