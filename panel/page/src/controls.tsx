import { useEffect, useState } from "preact/hooks";
import { link, useLink } from "./link";

// Who has the controls: one page at a time. Another one asks, and is given them, or not.

const kShownMs = 8000;

/** Says for a while that the holder keeps the controls. */
function useKept(): boolean {
  const { controls } = useLink("link");
  const asks = controls.asker !== 0 && controls.asker === controls.page;
  const [asked, setAsked] = useState(false);
  const [kept, setKept] = useState(false);
  useEffect(() => {
    const ended = asked && !asks && !controls.mine && controls.holder !== 0;
    setAsked(asks);
    if (asks) setKept(false);
    if (!ended) return;
    setKept(true);
    window.setTimeout(() => setKept(false), kShownMs);
  }, [asks, controls.mine]);
  return kept;
}

export function Controls() {
  const { controls, connected, user, machine } = useLink("link", "machine");
  const looks = user?.role === "look" || machine?.remote?.role === "look";
  const kept = useKept();
  if (controls.mine)
    return (
      <span class="controls">
        <span class="mine" data-test="controls">You have the controls</span>
        <button class="slim" data-test="give-up" onClick={() => link.giveControls()}>Give up</button>
      </span>
    );
  const asks = controls.asker !== 0 && controls.asker === controls.page;
  const text = controls.holder === 0 ? "Take the controls" : !asks ? "Ask for the controls"
    : controls.may_take ? "Take them now" : "Asked";
  const may = connected && !looks && (asks ? controls.may_take : controls.asker === 0);
  return (
    <span class="controls">
      {controls.holder !== 0 && (
        <span class="holder" data-test="holder">
          {asks && !controls.may_take ? `${controls.holder_name} is asked` : asks ? `${controls.holder_name} does not answer`
            : kept ? `${controls.holder_name} keeps the controls` : `${controls.holder_name} has the controls`}
        </span>
      )}
      {!looks && (
        <button class="accent" data-test="take" disabled={!may} onClick={() => link.takeControls()}>{text}</button>
      )}
    </span>
  );
}

/** On the page that has the controls: somebody asks for them. */
export function Asked() {
  const { controls } = useLink("link");
  if (!controls.mine || controls.asker === 0) return null;
  return (
    <div class="asked" role="alertdialog" aria-label="Somebody asks for the controls" data-test="asked">
      <strong>{controls.asker_name} asks for the controls.</strong>
      <span>{controls.may_take ? "You did not answer: they may be taken now." : "Without an answer they may be taken soon."}</span>
      <button class="accent" data-test="give" onClick={() => link.giveControls()}>Give them</button>
      <button data-test="keep" onClick={() => link.keepControls()}>Keep them</button>
    </div>
  );
}
