// What mouse, wheel, fingers and keys do, and when the picture is drawn: only after something has changed.
//
// data      what write.py puts into the page: camera {fx, fy, cx, cy, width, height}; stage {pivot, radius, upright};
//           start, what differs from START; held, the light that the mouse holds; lights, the others; background, CSS
// drawing   what createDrawing(canvas, data) gives, a promise or not: draw(view, lights, options), with
//           view {camera, pose}, camera in pixels of the canvas, pose camera-to-home, lights in home axes; options
//           {shading, shadows}

const CATCH_UP = 3; // how fast the light approaches the mouse, per rim that the mouse moves
const SLOP = 5; // CSS pixels that a click may move
const NOTCH = 100; // CSS pixels of a step of the wheel
const MOST_PIXELS = 4e6; // of the canvas: sharper ones only cost time
const KEY_TURN = 5; // degrees per key
const KEY_LIGHT = 0.1; // rims per key
const KEY_SHIFT = 0.04; // of the picture's smaller side per key
const BY_FINGERS = ["", "light", "orbit", "pan"]; // while the light is off: one finger less
const HOME = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]; // of the camera that the stage stands before
const GREETINGS = {
  mouse: "Move the mouse: the light follows. Drag to turn.",
  touch: "Move a finger: the light follows. Two fingers turn.",
};

const byId = (id) => document.getElementById(id);
const distance = ([x, y], [u, v]) => Math.hypot(u - x, v - y);

// Shows the page. Gives, for a console: ready, a promise that is kept when something is shown; data, drawing; state.
function control(canvas, data) {
  const start = { ...START, ...data.start };
  const castsShadows = [data.held, ...data.lights].some((one) => one.shadow);
  const isEmbedded = window !== window.top;
  let state = start;
  let drawing = null;
  let camera = fitted(data.camera, data.camera.width, data.camera.height);
  let ratio = 1; // canvas pixels per CSS pixel
  let frameAsked = false;

  function change(next, text) {
    if (text) say(text);
    if (next === state) return;
    state = next;
    showState();
    redraw();
  }

  function redraw() {
    if (frameAsked) return;
    frameAsked = true;
    requestAnimationFrame(draw);
  }

  function draw() {
    frameAsked = false;
    if (!drawing) return;
    const shading = state.lit ? state.shading : "none";
    const home = player ? player.way : HOME;
    const view = { camera, pose: product(home, pose(state, data.stage)) };
    const lights = [light(state, data.stage, home, data.held), ...data.lights];
    drawing.draw(view, lights, { shading, shadows: state.shadows, hurries: player && player.isPlaying });
    document.body.classList.add("live");
  }

  // Marker and buttons as the state has them.
  function showState() {
    const marker = byId("marker");
    marker.hidden = !drawing || !isLit(state);
    const [x, y] = markerPlace(state, data.stage, camera).map((place) => (place + 0.5) / ratio);
    const across = limited(x, 8, camera.width / ratio - 8), down = limited(y, 8, camera.height / ratio - 8);
    marker.style.transform = `translate(${across}px, ${down}px)`;
    marker.style.color = `rgb(${state.lightColor.map((c) => Math.round(255 * limited(c, 0, 1) ** (1 / 2.2)))})`;
    marker.classList.toggle("behind", isBehind(state));
    document.body.classList.toggle("lighting", state.lightMode && !marker.hidden);
    for (const [id, on] of [["follow", state.lightMode], ["unlit", !state.lit], ["shadows", state.shadows]])
      byId(id).setAttribute("aria-pressed", on);
    byId("shading").value = state.shading;
  }

  function resize() {
    const { width, height } = canvas.getBoundingClientRect();
    if (!width || !height) return;
    ratio = Math.min(window.devicePixelRatio, Math.sqrt(MOST_PIXELS / (width * height)));
    canvas.width = Math.max(1, Math.round(width * ratio));
    canvas.height = Math.max(1, Math.round(height * ratio));
    camera = fitted(data.camera, canvas.width, canvas.height);
    showState();
    draw(); // at once: a canvas of another size is empty
  }

  let silence = 0;
  function say(text, seconds = 2.5) {
    byId("message").textContent = text;
    document.body.classList.add("talking");
    clearTimeout(silence);
    silence = setTimeout(() => document.body.classList.remove("talking"), 1000 * seconds);
  }

  async function begin() {
    try {
      const made = await createDrawing(canvas, data);
      if (player) await player.attach(made);
      drawing = made;
      resize();
    } catch (error) {
      drawing = null;
      stayStill(error.message);
    }
  }

  function stayStill(reason) {
    document.body.classList.remove("live");
    canvas.hidden = byId("tools").hidden = true;
    byId("note").hidden = false;
    byId("note").textContent = `A still picture: ${reason}`;
  }

  const player = makePlayer(data, () => drawing && draw());
  const actions = makeActions(() => state, change, start, data.camera, castsShadows);
  const pointers = makePointers(data.stage, () => ({ state, camera, ratio, drawing }), change);
  listenToPointers(canvas, pointers, isEmbedded);
  listenToKeys({ ...actions, play: () => player && player.toggle() });
  listenToButtons(actions);
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault(); // or it never comes back
    drawing = null;
    document.body.classList.remove("live");
    showState();
  });
  canvas.addEventListener("webglcontextrestored", begin);
  new ResizeObserver(resize).observe(canvas);
  const wake = () => document.body.classList.toggle("awake", !isEmbedded || document.hasFocus());
  for (const name of ["focus", "blur"]) window.addEventListener(name, wake);
  wake();
  for (const each of [byId("shadows"), document.querySelector("tr.shadows")]) each.hidden = !castsShadows;
  byId("left-out").hidden = !data.leftOut.length;
  byId("left-out").textContent = `Here ${data.leftOut.join("; ")}.`;
  if (data.background) document.body.style.setProperty("--ground", data.background);
  canvas.hidden = byId("tools").hidden = false;
  say(GREETINGS[matchMedia("(pointer: coarse)").matches ? "touch" : "mouse"], 6);
  const ready = begin();
  return { ready, data, player, get drawing() { return drawing; }, get state() { return state; }, set state(next) { change(next); } };
}

// The actions of keys and buttons, by name.
function makeActions(current, change, start, camera, castsShadows) {
  const set = (changes, text) => change({ ...current(), ...changes }, text);
  return {
    follow() {
      const on = !current().lightMode;
      set({ lightMode: on }, on ? "the light follows" : "the light stays where it is");
    },
    unlit() {
      const lit = !current().lit;
      set({ lit }, lit ? "lit" : "unlit, as photographed");
    },
    shadows() {
      const on = !current().shadows;
      if (castsShadows) set({ shadows: on }, on ? "shadows on" : "shadows off");
    },
    shade(shading) {
      set({ shading, lit: true }, `shading: ${shading}`);
    },
    reset: () => change(resetView(current(), start), "view and light are reset"),
    turn: (x, y) => change(orbited(current(), x * KEY_TURN, y * KEY_TURN, DEGREES)),
    shift: (x, y) => change(panned(current(), x * KEY_SHIFT, y * KEY_SHIFT, camera.fx / Math.min(camera.width, camera.height))),
    zoom: (steps) => change(zoomed(current(), steps)),
    reach: (steps) => change(lightReached(current(), steps)),
    moveLight(x, y) {
      const [u, v] = current().lightAt;
      const place = [u + x * KEY_LIGHT, v + y * KEY_LIGHT];
      set({ lightAt: times(place, Math.min(1, FARTHEST / (Math.PI / 2) / Math.hypot(...place))) });
    },
    full: () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
    help: () => (byId("help").open ? byId("help").close() : byId("help").showModal()),
  };
}

// Turns moves, buttons, fingers and the wheel into changes of the state. The light never jumps when the mouse takes it.
function makePointers(stage, current, change) {
  let drag = ""; // "orbit", "pan", "light", "click" until it has moved, or "" while no button is down
  let began = null, last = null; // places of the mouse, CSS pixels
  let isClick = false; // whether the button has come up where it went down
  let beforeClick = null; // the state
  const fingers = new Map();
  let most = 0; // fingers of this touch
  let isTap = false;

  const inPixels = ([x, y], ratio) => [x * ratio - 0.5, y * ratio - 0.5];

  function rims(place) {
    const { state, camera, ratio } = current();
    return rimsFrom(middle(state, stage, camera), ...inPixels(place, ratio), camera);
  }

  function moved(action, before, after) {
    const { state, camera, ratio } = current();
    const [dx, dy] = [(after[0] - before[0]) * ratio, (after[1] - before[1]) * ratio];
    if (action === "orbit") return orbited(state, dx, dy, Math.min(camera.width, camera.height));
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
    } else change(moved(drag, before, place));
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
    if (count === 2) return turnAround(place);
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
    change(action === "light" ? placed(place) : moved(action, before.middle, after.middle));
    if (before.size && after.size) change(zoomed(current().state, Math.log(after.size / before.size) / Math.log(WHEEL)));
  }

  function lift(id, place) {
    if (fingers.delete(id) && isTap && place && current().state.lightMode) change(placed(place));
  }

  const wheel = (steps, isShift) => change((isShift ? lightReached : zoomed)(current().state, steps));
  return { press, move, release, click, leave, touch, drawFinger, lift, wheel };
}

function listenToPointers(canvas, pointers, isEmbedded) {
  const place = (event) => {
    const { left, top } = canvas.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  };
  const isFinger = (event) => event.pointerType === "touch";
  const on = (name, act) => canvas.addEventListener(name, act);
  on("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (isFinger(event)) pointers.touch(event.pointerId, place(event));
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

function listenToKeys(actions) {
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const keys = {
    l: actions.follow, b: actions.unlit, s: actions.shadows, r: actions.reset, f: actions.full, h: actions.help, "?": actions.help,
    "+": () => actions.zoom(1), "=": () => actions.zoom(1), "-": () => actions.zoom(-1),
    ",": () => actions.reach(-1), ".": () => actions.reach(1), " ": actions.play,
  };
  SHADINGS.forEach((shading, k) => (keys[k + 1] = () => actions.shade(shading)));
  document.addEventListener("keydown", (event) => {
    if (event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const isOfFocus = event.key === " " ? event.target.tagName === "BUTTON" : event.target.tagName === "INPUT";
    if (isOfFocus) return; // a button is pressed, a slider moves
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (byId("help").open && !"h?".includes(key)) return;
    if (arrows[key]) (event.ctrlKey ? actions.shift : event.shiftKey ? actions.moveLight : actions.turn)(...arrows[key]);
    else if (keys[key] && !event.ctrlKey) keys[key]();
    else return;
    event.preventDefault();
  });
}

function listenToButtons(actions) {
  for (const [id, act] of [["follow", actions.follow], ["unlit", actions.unlit], ["shadows", actions.shadows],
    ["reset", actions.reset], ["full", actions.full], ["ask", actions.help], ["close", actions.help]])
    byId(id).addEventListener("click", act);
  byId("shading").addEventListener("change", (event) => actions.shade(event.target.value));
  byId("help").addEventListener("click", (event) => event.target === byId("help") && byId("help").close()); // beside it
  byId("full").hidden = !document.fullscreenEnabled;
}

const pageData = JSON.parse(byId("data").textContent);
for (const part of ["shaders", "parts"]) pageData[part] = byId(part).textContent;
if (pageData.film) pageData.film.texts = [...document.querySelectorAll("script.frame")].map((one) => one.textContent);
window.pointshade = control(byId("picture"), pageData);
