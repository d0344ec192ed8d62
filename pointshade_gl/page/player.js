// Plays a sequence, pauses it, jumps in it. Frames are decoded before they are due, a few of them: more are never held.

const AHEAD = 3;

class Player {
  // film: { fps, frames }; thing: what its frames have in common; texts: of the frames, base64; changed: called when
  // another frame is shown, or is about to.
  constructor({ fps, frames }, thing, texts, changed) {
    Object.assign(this, { fps, frames, changed, index: 0, isPlaying: !matchMedia("(prefers-reduced-motion: reduce)").matches });
    this.reader = new FilmReader(thing, frames, texts);
    Object.assign(this, { drawing: null, ready: [], next: 0, target: 0, due: 0, jumps: 0, isReading: false });
  }

  get count() {
    return this.frames.length;
  }

  // Of who looks at the frame that is shown, to home axes.
  get way() {
    return this.frames[this.index].way;
  }

  // Shows the frame on another drawing, the first or one after a lost context.
  attach(drawing) {
    this.drawing = drawing;
    return new Promise((shown) => {
      this.attached = shown;
      this.jump(this.target ?? this.index);
    });
  }

  toggle() {
    this.isPlaying = !this.isPlaying;
    this.due = 0;
    this.changed();
  }

  jump(number) {
    for (const frame of this.ready) for (const image of Object.values(frame.pictures)) image.close();
    Object.assign(this, { ready: [], target: number, next: this.reader.keyOf(number), jumps: this.jumps + 1 });
    this.read();
  }

  async read() {
    if (this.isReading) return;
    this.isReading = true;
    while (this.drawing && this.ready.length < AHEAD) {
      const { jumps } = this, frame = await this.reader.read(this.next);
      if (jumps !== this.jumps) {
        for (const image of Object.values(frame.pictures)) image.close();
        continue;
      }
      this.ready.push(frame);
      this.next = (frame.number + 1) % this.count;
      if (this.target !== null) this.advance(performance.now());
    }
    this.isReading = false;
  }

  // Shows the frame that is asked for or due, if it is decoded. Time that was lost is not made up.
  advance(now) {
    while (this.drawing && this.ready.length) {
      const isAsked = this.target !== null;
      if (!isAsked && (!this.isPlaying || now < this.due)) return;
      const frame = this.ready.shift();
      this.drawing.film.pass(frame);
      this.read();
      if (isAsked && frame.number !== this.target) continue;
      this.show(frame);
      const pause = 1000 / this.fps;
      this.due = (now - this.due > pause ? now : this.due) + pause;
    }
  }

  show(frame) {
    this.drawing.film.show(frame);
    this.drawing.changeFrame(frame.head);
    [this.index, this.target] = [frame.number, null];
    if (this.attached) this.attached();
    this.attached = null;
    this.changed();
  }
}

// The player of a page, with its slider and button; none where nothing plays. redraw: when another frame is shown.
function makePlayer(data, redraw) {
  if (!data.film) return null;
  const slider = byId("frame"), button = byId("play");
  const player = new Player(data.film, data.things[0], data.film.texts, () => {
    showPlayer();
    redraw();
  });

  function showPlayer() {
    if (player.target === null) slider.value = player.index;
    slider.setAttribute("aria-valuetext", `frame ${player.index + 1} of ${player.count}`);
    byId("number").textContent = `${Number(slider.value) + 1} / ${player.count}`;
    button.setAttribute("aria-label", player.isPlaying ? "Pause" : "Play");
    button.title = player.isPlaying ? "Pause (Space)" : "Play (Space)";
    button.classList.toggle("playing", player.isPlaying);
    tick();
  }

  let isTicking = false;
  function tick() {
    if (isTicking || !player.isPlaying) return;
    isTicking = true;
    requestAnimationFrame((now) => {
      isTicking = false;
      player.advance(now);
      tick();
    });
  }

  slider.max = player.count - 1;
  slider.addEventListener("input", () => {
    player.jump(Number(slider.value));
    if (player.isPlaying) player.toggle();
  });
  slider.addEventListener("pointerdown", () => player.isPlaying && player.toggle()); // also at the frame that is shown
  button.addEventListener("click", () => player.toggle());
  for (const each of document.querySelectorAll(".film")) each.hidden = false;
  showPlayer();
  return player;
}
