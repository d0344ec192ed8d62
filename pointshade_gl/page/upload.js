// What page_file.py has packed -> things on the GPU.

async function takeThings(gl, reader, heads) {
  const things = [];
  const takers = { mesh: takeMesh, points: takePoints, cloud: (...given) => takeCloud(...given), splats: (...given) => takeSplats(...given), set: (...given) => takeSet(...given) };
  for (const head of heads) things.push(head.isFilm ? makeFilmPoints(gl, head) : await takers[head.kind](gl, reader, head));
  for (const one of things) if (one.kind === "points" && one.kinds && !one.sizes) one.few = makeNumbers(gl, everySecond(one.kinds, one.width));
  return things;
}

// The points of a frame.
async function takePoints(gl, reader, head) {
  const { width, height } = head;
  const { surface, lit, kinds } = surfacePlane(reader, head);
  const colors = await takeColors(gl, reader, head.color, kinds, head.count);
  const thing = { ...head, surface: makeTexture(gl, "rgba32f", width, height, surface), colors };
  thing.normals = lit && makeTexture(gl, "rgba32f", width, height, lit);
  thing.known = makeIndices(gl, kinds, 1);
  if (head.hasRims) thing.rims = listed(numbersOf(kinds, 2));
  thing.certainty = makeCertainty(gl, readCertainty(reader, head));
  if (head.size === null) thing.sizes = makeBuffer(gl, gl.ARRAY_BUFFER, reader.take(4 * width * height));
  return Object.assign(thing, { kinds });
}

// The points of a film's frames, one after the other: film.js fills them.
function makeFilmPoints(gl, head) {
  const surface = makeTexture(gl, "rgba32f", head.width, head.height), colors = makeTexture(gl, "rgba8", head.color.width, head.color.height);
  const [known, rims, few] = [0, 1, 2].map(() => ({ buffer: gl.createBuffer(), count: 0 }));
  return { ...head, surface, colors, known, few, rims: head.hasRims ? rims : null, certainty: null };
}

// How certain normals are, { columns, rows, values }; null where all are.
function readCertainty(reader, { certainty }) {
  if (!certainty) return null;
  const [columns, rows] = certainty, cells = reader.take(2 * columns * rows).slice();
  return { columns, rows, values: Float32Array.from(new Uint16Array(cells.buffer), (value) => value / 65535) };
}

function makeCertainty(gl, found) {
  return found && makeTexture(gl, "r16f", found.columns, found.rows, found.values, gl.LINEAR);
}

// A picture; of a frame's own size it has colours where points are known.
async function takeColors(gl, reader, { width, height, jpeg, ofPoints }, kinds, known) {
  if (!jpeg) {
    const count = ofPoints ? known : width * height;
    return makeTexture(gl, "rgba8", width, height, colorPlanes(reader, width, height, ofPoints ? kinds : null, count));
  }
  const plain = { colorSpaceConversion: "none", premultiplyAlpha: "none" };
  const image = await createImageBitmap(new Blob([reader.take(jpeg)], { type: "image/jpeg" }), plain);
  const texture = makeTexture(gl, "rgba8", width, height);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, image);
  return texture;
}

// Which pixels are drawn as points: their numbers, which gl_VertexID gives.
function makeIndices(gl, kinds, least) {
  return makeNumbers(gl, numbersOf(kinds, least));
}

function makeNumbers(gl, numbers) {
  return { buffer: makeBuffer(gl, gl.ELEMENT_ARRAY_BUFFER, numbers), count: numbers.length };
}

// Rims that are estimated when they are first drawn.
const listed = (list) => ({ list, count: list.length, known: null });

function numbersOf(kinds, least) {
  const numbers = new Uint32Array(kinds.length);
  let n = 0;
  for (let k = 0; k < kinds.length; ++k) if (kinds[k] >= least) numbers[n++] = k;
  return numbers.slice(0, n);
}

function makeBuffer(gl, kind, data) {
  const buffer = gl.createBuffer();
  gl.bindBuffer(kind, buffer);
  gl.bufferData(kind, data, gl.STATIC_DRAW);
  return buffer;
}

// Corners come number by number: all x, all y, and so on.
async function takeMesh(gl, reader, head) {
  const count = head.vertices, planes = new Float32Array(reader.take(44 * count).slice().buffer);
  const corners = new Float32Array(11 * count);
  for (let k = 0; k < count; ++k) for (let n = 0; n < 11; ++n) corners[11 * k + n] = planes[n * count + k];
  const faces = new Uint32Array(reader.take(4 * head.corners).slice().buffer);
  const thing = { ...head, corners: makeBuffer(gl, gl.ARRAY_BUFFER, corners), colors: null };
  thing.faces = { buffer: makeBuffer(gl, gl.ELEMENT_ARRAY_BUFFER, faces), count: head.corners };
  const tints = head.tinted && new Float32Array(new Int16Array(reader.take(6 * count).slice().buffer)).map((one) => one / 32767);
  thing.tints = tints ? makeBuffer(gl, gl.ARRAY_BUFFER, tints) : null;
  const { width, height } = head.texture || {};
  if (head.texture) thing.colors = await takeColors(gl, reader, { ...head.texture, ofPoints: false }, null, width * height);
  else thing.colors = makeTexture(gl, "rgba8", 1, 1, new Uint8Array(4).fill(255));
  gl.bindTexture(gl.TEXTURE_2D, thing.colors);
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.REPEAT);
  return thing;
}
