// WebGL 2: programs from the shader files, textures and targets.

class Programs {
  constructor(gl, texts) {
    this.gl = gl;
    this.texts = texts;
    this.made = new Map();
  }

  // The program of two files, made when it is first needed. Constants are defined in both.
  get(vertex, fragment, constants = {}) {
    const key = JSON.stringify([vertex, fragment, constants]);
    if (!this.made.has(key)) this.made.set(key, new Program(this.gl, this.texts, vertex, fragment, constants));
    return this.made.get(key);
  }
}

class Program {
  constructor(gl, texts, vertex, fragment, constants) {
    this.gl = gl;
    const defines = Object.entries(constants).map(([name, value]) => `#define ${name} ${value}\n`).join("");
    this.program = gl.createProgram();
    for (const [kind, name] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, `#version 300 es\n${defines}${texts[name]}`);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(this.program).map((shader) => gl.getShaderInfoLog(shader));
      throw new Error(`${vertex}, ${fragment}: ${gl.getProgramInfoLog(this.program)} ${logs.join(" ")}`);
    }
    this.uniforms = new Map();
    const count = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS);
    for (let k = 0; k < count; ++k) {
      const { name, type } = gl.getActiveUniform(this.program, k);
      this.uniforms.set(name, { type, place: gl.getUniformLocation(this.program, name) });
    }
  }

  attribute(name) {
    return this.gl.getAttribLocation(this.program, name);
  }

  // Uses the program with these values by name; those that it does not read are left out. Matrices are rows, samplers
  // take textures.
  use(inputs) {
    const gl = this.gl;
    gl.useProgram(this.program);
    let unit = 0;
    for (const [name, { type, place }] of this.uniforms) {
      const value = inputs[name];
      if (type === gl.SAMPLER_2D || type === gl.INT_SAMPLER_2D) {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, value);
        gl.uniform1i(place, unit++);
      } else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(place, true, value.flat());
      else if (type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(place, true, value.flat());
      else if (type === gl.FLOAT) gl.uniform1f(place, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(place, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(place, value);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(place, value);
      else if (type === gl.INT_VEC2) gl.uniform2iv(place, value);
      else gl.uniform1i(place, value); // int and bool
    }
  }
}

// A texture of one of the formats below, read texel by texel.
function makeTexture(gl, format, width, height, data = null, filter = gl.NEAREST) {
  const [inner, outer, type] = {
    rgba8: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE],
    rgba16f: [gl.RGBA16F, gl.RGBA, gl.HALF_FLOAT],
    rgba32f: [gl.RGBA32F, gl.RGBA, gl.FLOAT],
    r32f: [gl.R32F, gl.RED, gl.FLOAT],
    r16f: [gl.R16F, gl.RED, gl.FLOAT],
    r32i: [gl.R32I, gl.RED_INTEGER, gl.INT],
    depth: [gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT],
  }[format];
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, outer, type, data);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, filter);
  for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
  return texture;
}

// A framebuffer of textures, the last of which may be its depth.
function makeTarget(gl, textures, depth) {
  const target = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  const places = textures.map((texture, k) => {
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, texture, 0);
    return gl.COLOR_ATTACHMENT0 + k;
  });
  if (depth) gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
  gl.drawBuffers(places.length ? places : [gl.NONE]);
  return target;
}
