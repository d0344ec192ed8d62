// What mouse, wheel and fingers do.

const CATCH_UP = 3; // how fast the light approaches the mouse, per rim that the mouse moves
const SLOP = 5; // CSS pixels that a click may move
const NOTCH = 100; // CSS pixels of a step of the wheel
const BY_FINGERS = ["", "light", "orbit", "pan"]; // while the light is off: one finger less

const distance = ([x, y], [u, v]) => Math.hypot(u - x, v - y);

// Turns moves, buttons, fingers and the wheel into changes of the state. The light never jumps when the mouse takes it.
function makePointers(stage, current, change) {
  let drag = ""; // "orbit", "pan", "light", "nothing", "click" until it has moved, or "" while no button is down
  let began = null, last = null; // places of the mouse, CSS pixels
  let isClick = false; // whether the button has come up where it went down
  let beforeClick = null; // the state; null where there was none
  const fingers = new Map();
  let most = 0; // fingers of this touch
  let isTap = false;

  const inPixels = ([x, y], ratio) => [x * ratio - 0.5, y * ratio - 0.5];

  // Of what has turned; it is told where drags end.
  function turnTo(next) {
    const { state } = current();
    const ends = isNearEnd(next, stage) && (next.yaw !== state.yaw || next.pitch !== state.pitch);
    change(next, ends ? END_TEXT : "");
  }

  function rims(place) {
    const { state, camera, ratio } = current();
    return rimsFrom(middle(state, stage, camera), ...inPixels(place, ratio), camera);
  }

  function moved(action, before, after) {
    const { state, camera, ratio } = current();
    const [dx, dy] = [(after[0] - before[0]) * ratio, (after[1] - before[1]) * ratio];
    if (action === "orbit") return orbited(state, dx, dy, Math.min(camera.width, camera.height), stage);
    return action === "pan" ? panned(state, dx, dy, camera.fx) : state;
  }

  // The light follows the mouse. If they are apart when the mouse takes it, the gap shrinks with each move.
  function followed(before, after) {
    const { state } = current();
    const from = rims(before), to = rims(after);
    const gap = plus(state.lightAt, times(from, -1));
    return { ...state, lightAt: plus(to, times(gap, Math.exp(-CATCH_UP * distance(from, to)))) };
  }

  const placed = (place) => ({ ...current().state, lightAt: rims(place) });

  function press(place, button, isCtrl, isShift) {
    if (drag) return;
    began = last = place;
    if (button === 1 || (button === 0 && isCtrl && !isShift)) drag = "pan";
    else if (button === 0) drag = isCtrl ? "light" : "click";
    document.body.classList.toggle("dragging", drag === "pan");
  }

  // A press that does nothing, until it ends.
  function ignore(isFinger) {
    if (!isFinger && !drag) drag = "nothing";
    [isClick, beforeClick] = [false, null];
  }

  function move(place) {
    const before = last ?? place;
    if (drag === "click") {
      if (distance(began, place) <= SLOP) return;
      drag = "orbit";
      document.body.classList.add("dragging");
    }
    last = place;
    if (drag === "light" || (!drag && current().state.lightMode)) {
      if (distance(before, place)) change(followed(before, place));
    } else turnTo(moved(drag, before, place));
  }

  function release(place) {
    isClick = drag === "click";
    drag = "";
    last = place;
    document.body.classList.remove("dragging");
  }

  // A click places a light that follows, and keeps it; one that is kept already is left alone. The second one of a
  // double click sets what orbits turn around instead.
  function click(place, count) {
    if (!isClick) return;
    if (count === 2 && beforeClick) return turnAround(place);
    beforeClick = current().state;
    if (!beforeClick.lightMode || !isLit(beforeClick)) return;
    change({ ...placed(place), lightMode: false }, "the light stays here; L lets it follow");
  }

  function turnAround(place) {
    const { camera, ratio, drawing } = current(), [x, y] = inPixels(place, ratio);
    const z = drawing ? drawing.depthAt(Math.round(x), Math.round(y)) : 0;
    const point = [((x - camera.cx) / camera.fx) * z, ((y - camera.cy) / Math.abs(camera.fy)) * z, z];
    const pivot = z ? point : seenMiddle(beforeClick, stage);
    if (pivot[2] > 0) change(withPivot(beforeClick, pivot, stage), z ? "turns around this point" : "turns around the middle");
  }

  function leave() {
    if (!drag) last = null;
  }

  const spread = (places) => {
    const middle = times(places.reduce(plus), 1 / places.length);
    return { middle, size: places.reduce((sum, place) => sum + distance(place, middle), 0) / places.length };
  };

  function touch(id, place) {
    isClick = false; // of the mouse: browsers send a click after a tap, too
    if (!fingers.size) [most, isTap, began] = [0, true, place];
    fingers.set(id, place);
    most = Math.max(most, fingers.size);
    isTap = isTap && most === 1;
  }

  function drawFinger(id, place) {
    if (!fingers.has(id)) return;
    if (isTap && distance(began, place) <= SLOP) return;
    isTap = false;
    const before = spread([...fingers.values()]);
    fingers.set(id, place);
    if (fingers.size < most) return; // the others have left: this one does nothing new
    const after = spread([...fingers.values()]);
    const action = BY_FINGERS[Math.min(current().state.lightMode ? most : most + 1, 3)];
    turnTo(action === "light" ? placed(place) : moved(action, before.middle, after.middle));
    if (before.size && after.size) change(zoomed(current().state, Math.log(after.size / before.size) / Math.log(WHEEL)));
  }

  function lift(id, place) {
    if (fingers.delete(id) && isTap && place && current().state.lightMode) change(placed(place));
  }

  const wheel = (steps, isShift) => change((isShift ? lightReached : zoomed)(current().state, steps));
  return { press, ignore, move, release, click, leave, touch, drawFinger, lift, wheel };
}

function listenToPointers(canvas, pointers, isEmbedded) {
  const place = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const isFinger = (event) => event.pointerType === "touch";
  const on = (name, act) => canvas.addEventListener(name, act);
  let isAwake = document.hasFocus(), focused = -Infinity; // since when
  window.addEventListener("focus", () => ([isAwake, focused] = [true, performance.now()]));
  window.addEventListener("blur", () => (isAwake = false));
  // Whether a press only takes the focus, or closes a box. Browsers give the focus before or after they tell of the press.
  const isTaken = (event) => {
    const isFirst = isEmbedded && (!isAwake || event.timeStamp <= focused), isOpen = !byId("lamp-box").hidden;
    isAwake = true;
    if (isOpen) toggleLamp(false);
    return isFirst || isOpen;
  };
  on("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (isTaken(event)) pointers.ignore(isFinger(event));
    else if (isFinger(event)) pointers.touch(event.pointerId, place(event));
    else pointers.press(place(event), event.button, event.ctrlKey || event.metaKey, event.shiftKey);
  });
  on("pointermove", (event) => {
    if (isFinger(event)) pointers.drawFinger(event.pointerId, place(event));
    else pointers.move(place(event));
  });
  on("pointerup", (event) => {
    if (isFinger(event)) pointers.lift(event.pointerId, place(event));
    else if (!event.buttons) pointers.release(place(event));
  });
  on("click", (event) => pointers.click(place(event), event.detail));
  on("pointercancel", (event) => (isFinger(event) ? pointers.lift(event.pointerId) : pointers.leave()));
  on("pointerleave", (event) => isFinger(event) || pointers.leave());
  on("mousedown", (event) => event.button === 1 && event.preventDefault()); // the browser's own scrolling
  const wheel = (event) => {
    if (isEmbedded && !document.hasFocus()) return; // the page around it scrolls
    event.preventDefault();
    const delta = event.deltaY || event.deltaX; // browsers turn the wheel aside while Shift is down
    const pixels = event.deltaMode === 0 ? delta : delta * (event.deltaMode === 1 ? NOTCH / 3 : NOTCH);
    pointers.wheel(limited((-pixels / NOTCH) * (event.ctrlKey ? 5 : 1), -3, 3), event.shiftKey); // Ctrl: a pinch
  };
  canvas.addEventListener("wheel", wheel, { passive: false });
}
