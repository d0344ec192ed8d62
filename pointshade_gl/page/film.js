// The frames of a sequence: bytes (page/films.py) -> what is uploaded, in steps of a few milliseconds -> the points on the GPU.

const breath = () => new Promise((go) => setTimeout(go)); // events and pictures come between two steps

// Whole numbers of `size` bytes each, of which all low bytes come first.
function wholeNumbers(bytes, count, size) {
  const numbers = new Int32Array(count);
  for (let n = 0; n < count; ++n) numbers[n] = bytes[n];
  for (let k = 1; k < size; ++k) for (let n = 0, at = k * count; n < count; ++n, ++at) numbers[n] |= bytes[at] << (8 * k);
  for (let n = 0; n < count; ++n) numbers[n] = (numbers[n] >>> 1) ^ -(numbers[n] & 1);
  return numbers;
}

// The codes of depths, which those on the left and above predict; what is not known repeats its neighbour.
function predictedCodes(width, height, kinds, errors) {
  const codes = new Int32Array(width * height);
  for (let y = 0, k = 0, n = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x, ++k) {
      const a = x > 0 ? codes[k - 1] : y > 0 ? codes[k - width] : 0;
      if (kinds[k] === 0) {
        codes[k] = a;
        continue;
      }
      const b = y > 0 ? codes[k - width] : a, c = x > 0 && y > 0 ? codes[k - width - 1] : x > 0 ? a : b;
      const low = a < b ? a : b, high = a < b ? b : a, plane = a + b - c;
      codes[k] = (plane < low ? low : plane > high ? high : plane) + errors[n++];
    }
  }
  return codes;
}

// Those of the frame before, changed where points are known.
function changedCodes(before, kinds, changes) {
  const codes = before.slice();
  for (let k = 0, n = 0; k < codes.length; ++k) if (kinds[k] !== 0) codes[k] += changes[n++];
  return codes;
}

// Decodes one frame after another; a frame of differences after the one before it.
class FilmReader {
  constructor({ width, height }, frames, texts) {
    Object.assign(this, { width, height, frames, texts, kinds: null, codes: null });
  }

  // The last frame up to k that is not of differences.
  keyOf(k) {
    while (this.frames[k].changes.some(Boolean)) --k;
    return k;
  }

  async read(number) {
    const head = this.frames[number], { width, height } = this, reader = new Reader(await unpacked(this.texts[number]));
    const [areKinds, areDepths] = head.changes, kinds = reader.take(width * height);
    if (areKinds) for (let k = 0; k < kinds.length; ++k) kinds[k] ^= this.kinds[k];
    const bytes = reader.take(head.count * head.depthBytes);
    const images = [head.normalBytes, head.colorBytes].map((size) => decodedPlanes(reader.take(size)));
    const numbers = wholeNumbers(bytes, head.count, head.depthBytes);
    await breath();
    const codes = areDepths ? changedCodes(this.codes, kinds, numbers) : predictedCodes(width, height, kinds, numbers);
    [this.kinds, this.codes] = [kinds, codes];
    await breath();
    const packed = new Int32Array(codes.length);
    for (let k = 0; k < packed.length; ++k) packed[k] = (codes[k] << 2) | kinds[k];
    const known = numbersOf(kinds, 1), rims = numbersOf(kinds, 2), few = everySecond(kinds, width);
    await breath();
    const [normals, colors] = await Promise.all(images);
    return { number, head, packed, known, rims, few, pictures: { normals, colors }, certainty: readCertainty(reader, head) };
  }
}

// The numbers of known pixels, of every second one of every second row.
function everySecond(kinds, width) {
  const numbers = new Uint32Array(kinds.length);
  let n = 0;
  for (let row = 0; row < kinds.length; row += 2 * width) {
    for (let k = row; k < row + width; k += 2) if (kinds[k] !== 0) numbers[n++] = k;
  }
  return numbers.slice(0, n);
}

function decodedPlanes(bytes) {
  return createImageBitmap(new Blob([bytes], { type: "image/webp" }), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
}

// Planes of pictures, which later frames change.
class Planes {
  constructor(gl, painter, width, height) {
    Object.assign(this, { gl, painter, box: [0, 0, width, height] });
    [this.now, this.other, this.change] = [0, 1, 2].map(() => makeTexture(gl, "rgba8", width, height));
  }

  take(image, isChange) {
    const { gl, painter } = this;
    gl.bindTexture(gl.TEXTURE_2D, isChange ? this.change : this.now);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
    image.close();
    if (!isChange) return;
    const target = makeTarget(gl, [this.other]);
    painter.fill(target, this.box, "surface/film_change.frag", {}, { before_map: this.now, change_map: this.change }, false);
    gl.deleteFramebuffer(target);
    [this.now, this.other] = [this.other, this.now];
  }
}

const FINE = 0.75; // pixels of a view for one of a frame

// Whether a view is too small to show each point.
function isFine({ few, source }, camera) {
  return few && camera.fx < FINE * source[0];
}

// Every second point of every second row, twice as large.
function fewer(thing) {
  return { ...thing, known: thing.few, rims: null, hasRims: false, size: 2 * thing.size };
}

// The one thing of a page whose sequence plays: it holds one frame at a time.
class Film {
  constructor(gl, painter, thing) {
    Object.assign(this, { gl, painter, thing });
    const { width, height, color } = thing;
    this.normals = new Planes(gl, painter, width, 2 * height);
    this.colors = new Planes(gl, painter, color.width, 3 * color.height);
    this.codes = makeTexture(gl, "r32i", width, height);
    [this.surface, this.picture] = [thing.surface, thing.colors].map((texture) => makeTarget(gl, [texture]));
  }

  // Frames are passed in their order, also those that are not shown.
  pass({ head, pictures }) {
    this.normals.take(pictures.normals, head.changes[2]);
    this.colors.take(pictures.colors, head.changes[3]);
  }

  show({ head, packed, known, rims, few, certainty }) {
    const { gl, painter, thing } = this, { width, height, color, nearest, depthStep } = thing;
    gl.bindTexture(gl.TEXTURE_2D, this.codes);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED_INTEGER, gl.INT, packed);
    const inputs = { codes: this.codes, normal_planes: this.normals.now, nearest, depth_step: depthStep };
    painter.fill(this.surface, [0, 0, width, height], "surface/film_surface.frag", {}, inputs, false);
    painter.fill(this.picture, [0, 0, color.width, color.height], "surface/film_colors.frag", {}, { color_planes: this.colors.now }, false);
    for (const [indices, numbers] of [[thing.known, known], [thing.rims, rims], [thing.few, few]]) {
      if (!indices) continue;
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices.buffer);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, numbers, gl.DYNAMIC_DRAW);
      indices.count = numbers.length;
    }
    for (const texture of [thing.certainty, thing.visibility, thing.hidden && thing.hidden.surface]) gl.deleteTexture(texture || null);
    if (thing.hidden) gl.deleteBuffer(thing.hidden.known.buffer);
    const { source, axes, middle } = head;
    Object.assign(thing, { source, axes, middle, visibility: null, hidden: null, certainty: makeCertainty(gl, certainty) });
  }
}
