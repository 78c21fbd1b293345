// Programs, textures and meshes of WebGL 2, and the drawing of a frame.

const SHARED_EXPONENT = 'UNSIGNED_INT_5_9_9_9_REV';

/** How the texels of each format are given to WebGL. */
const FORMATS = {
    rgb16f: { internal: 'RGB16F', format: 'RGB', type: 'HALF_FLOAT', Texels: Uint16Array, bytes: 6 },
    rgba16f: { internal: 'RGBA16F', format: 'RGBA', type: 'HALF_FLOAT', Texels: Uint16Array, bytes: 8 },
    rgba32f: { internal: 'RGBA32F', format: 'RGBA', type: 'FLOAT', Texels: Float32Array, bytes: 16 },
    rgb9e5: { internal: 'RGB9_E5', format: 'RGB', type: SHARED_EXPONENT, Texels: Uint32Array, bytes: 4 },
    r32ui: { internal: 'R32UI', format: 'RED_INTEGER', type: 'UNSIGNED_INT', Texels: Uint32Array, bytes: 4 },
};

/** The bytes of textures that are kept although the picture does not need them, and the number of meshes. */
const TEXTURE_BUDGET = 256 * 2 ** 20;
const MESH_BUDGET = 8;

/** Where a mesh is of which nothing is known. */
const UNIT_BALL = { centre: [0, 0, 0], radius: 1 };

/** Columns and rows of the types that members of uniform blocks have. */
const SHAPES = (() => {
    const shapes = {};
    const names = WebGL2RenderingContext;
    for (const kind of ['FLOAT', 'INT', 'UNSIGNED_INT', 'BOOL']) {
        const isFloat = kind === 'FLOAT';
        shapes[names[kind]] = { columns: 1, rows: 1, isFloat };
        for (const n of [2, 3, 4]) shapes[names[`${kind}_VEC${n}`]] = { columns: 1, rows: n, isFloat };
    }
    for (const columns of [2, 3, 4]) {
        for (const rows of [2, 3, 4]) {
            const size = columns === rows ? columns : `${columns}x${rows}`;
            shapes[names[`FLOAT_MAT${size}`]] = { columns, rows, isFloat: true };
        }
    }
    return shapes;
})();

/**
 * What a map keeps under a key, made if it is missing, and now the last of the map. A promise that fails is
 * not kept.
 */
function kept(map, key, make) {
    let made = map.get(key);
    if (!made) {
        made = make();
        made.catch(() => map.delete(key));
    }
    map.delete(key);
    map.set(key, made);
    return made;
}

/** The bytes of a uniform block. Values are numbers, or lists of them in the order of columns. */
function blockContent({ size, members }, values) {
    const content = new DataView(new ArrayBuffer(size));
    for (const { name, offset, length, stride, columnStride, columns, rows, isFloat } of members) {
        const numbers = [values[name] ?? []].flat(2);
        const put = (isFloat ? content.setFloat32 : content.setInt32).bind(content);
        const most = Math.min(numbers.length, length * columns * rows);
        for (let i = 0; i < most; i++) {
            const [row, column] = [i % rows, Math.floor(i / rows) % columns];
            const element = Math.floor(i / (rows * columns));
            put(offset + element * stride + column * columnStride + 4 * row, numbers[i], true);
        }
    }
    return content;
}

/** One context's objects. A context that was lost and restored gets a new renderer. */
class Renderer {
    constructor(gl) {
        this.gl = gl;
        this.programs = new Map();
        this.textures = new Map();
        this.meshes = new Map();
        this.targets = null;
        this.parallel = gl.getExtension('KHR_parallel_shader_compile');
        const float = gl.getExtension('EXT_color_buffer_float');
        /** The formats that a difference can be computed from, the best first. */
        this.targetFormats = float ? ['RGBA32F', 'RGBA16F'] : [];
        if (!float && gl.getExtension('EXT_color_buffer_half_float')) this.targetFormats.push('RGBA16F');
        this.nothing = gl.createVertexArray();
        gl.depthFunc(gl.LEQUAL);
    }

    // ---- programs

    /** The program of blobs of GLSL, with what is defined before them. */
    program({ vertex, fragment, functions, defines }) {
        const head = Object.entries(defines).map(([name, value]) => `#define ${name} ${value}\n`);
        const source = async (...blobs) => {
            const texts = await Promise.all(blobs.filter((index) => index !== undefined).map(textBlob));
            return ['#version 300 es\n', ...head, ...texts].join('');
        };
        const key = [vertex, fragment, functions, ...head].join();
        const sources = () => Promise.all([source(vertex), source(fragment, functions)]);
        return kept(this.programs, key, () => this.buildProgram(sources()));
    }

    async buildProgram(texts) {
        const { gl, parallel } = this;
        const sources = await texts;
        const handle = gl.createProgram();
        const shaders = [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].map((type, i) => {
            const shader = gl.createShader(type);
            gl.shaderSource(shader, sources[i]);
            gl.compileShader(shader);
            gl.attachShader(handle, shader);
            return shader;
        });
        gl.linkProgram(handle);
        while (parallel && gl.getProgramParameter(handle, parallel.COMPLETION_STATUS_KHR) === false) {
            await new Promise((resolve) => setTimeout(resolve, 4));
        }
        if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
            const logs = shaders.map((shader) => gl.getShaderInfoLog(shader));
            logs.push(gl.getProgramInfoLog(handle));
            throw new Error(`The shaders do not compile.\n${logs.filter(Boolean).join('\n')}`);
        }
        for (const shader of shaders) gl.deleteShader(shader);
        return { handle, samplers: this.samplersOf(handle), blocks: this.blocksOf(handle) };
    }

    /** The samplers of a program, each of which gets a texture unit of its own. */
    samplersOf(handle) {
        const { gl } = this;
        const samplers = [];
        gl.useProgram(handle);
        for (let i = 0; i < gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS); i++) {
            const { name } = gl.getActiveUniform(handle, i);
            const location = gl.getUniformLocation(handle, name);
            if (!location) continue; // a member of a block
            gl.uniform1i(location, samplers.length);
            samplers.push(name);
        }
        return samplers;
    }

    /** The uniform blocks of a program: a buffer for each, and where its members lie. */
    blocksOf(handle) {
        const { gl } = this;
        const count = gl.getProgramParameter(handle, gl.ACTIVE_UNIFORM_BLOCKS);
        return Array.from({ length: count }, (_, block) => {
            gl.uniformBlockBinding(handle, block, block);
            const said = (what) => gl.getActiveUniformBlockParameter(handle, block, gl[what]);
            const size = said('UNIFORM_BLOCK_DATA_SIZE');
            const indices = said('UNIFORM_BLOCK_ACTIVE_UNIFORM_INDICES');
            const each = (what) => gl.getActiveUniforms(handle, indices, gl[what]);
            const offsets = each('UNIFORM_OFFSET');
            const strides = each('UNIFORM_ARRAY_STRIDE');
            const columnStrides = each('UNIFORM_MATRIX_STRIDE');
            const members = Array.from(indices, (index, i) => {
                const { name, size: length, type } = gl.getActiveUniform(handle, index);
                return {
                    name: name.replace(/\[0\]$/, ''),
                    length,
                    offset: offsets[i],
                    stride: strides[i],
                    columnStride: columnStrides[i],
                    ...SHAPES[type],
                };
            });
            const name = gl.getActiveUniformBlockName(handle, block).replace(/_block$/, '');
            return { name, buffer: gl.createBuffer(), size, members };
        });
    }

    // ---- textures

    /** The texture that the page describes. Two may have the same bytes in other sizes. */
    texture(said) {
        return kept(this.textures, JSON.stringify(said), () => this.makeTexture(said));
    }

    async makeTexture(said) {
        const { gl } = this;
        const { format, size: [width, height, layers], array, linear } = said;
        if (layers > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS)) {
            throw new Error(`This device has no textures of ${layers} layers.`);
        }
        if (Math.max(width, height) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
            throw new Error(`This device has no textures of ${width} x ${height} texels.`);
        }
        const { internal, format: order, type, Texels, bytes: texel } = FORMATS[format];
        const bytes = width * height * layers * texel;
        const { buffer } = await numbersBlob(said);
        if (buffer.byteLength !== bytes) {
            throw new Error(`Blob ${said.blob} has ${buffer.byteLength} bytes, and its texture ${bytes}.`);
        }
        const texels = new Texels(buffer);
        const handle = gl.createTexture();
        const target = array ? gl.TEXTURE_2D_ARRAY : gl.TEXTURE_2D;
        gl.bindTexture(target, handle);
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
        if (array) {
            gl.texStorage3D(target, 1, gl[internal], width, height, layers);
            gl.texSubImage3D(target, 0, 0, 0, 0, width, height, layers, gl[order], gl[type], texels);
        } else {
            gl.texStorage2D(target, 1, gl[internal], width, height);
            gl.texSubImage2D(target, 0, 0, 0, width, height, gl[order], gl[type], texels);
        }
        this.sample(target, linear ? gl.LINEAR : gl.NEAREST);
        return { handle, target, bytes };
    }

    sample(target, filter) {
        const { gl } = this;
        gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
        gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
        gl.texParameteri(target, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
        gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    }

    /** Drops what was not used for longest, down to the budget, but nothing that these passes read. */
    async trimTextures(passes) {
        const needed = new Set(passes.flatMap((pass) => Object.values(pass.textures)));
        const keys = [...this.textures.keys()];
        const textures = await Promise.all([...this.textures.values()].map((made) => made.catch(() => null)));
        let bytes = textures.reduce((sum, texture) => sum + (texture?.bytes ?? 0), 0);
        for (const [i, texture] of textures.entries()) {
            if (bytes <= TEXTURE_BUDGET) break;
            if (!texture || needed.has(texture)) continue;
            this.gl.deleteTexture(texture.handle);
            this.textures.delete(keys[i]);
            bytes -= texture.bytes;
        }
    }

    // ---- meshes

    mesh(said) {
        const made = kept(this.meshes, JSON.stringify(said), () => this.makeMesh(said));
        if (this.meshes.size > MESH_BUDGET) this.dropMesh(this.meshes.keys().next().value);
        return made;
    }

    /** Drops the mesh of a key. */
    async dropMesh(key) {
        const dropped = this.meshes.get(key);
        this.meshes.delete(key);
        for (const { array, buffers } of (await dropped).parts) {
            this.gl.deleteVertexArray(array);
            for (const buffer of buffers) this.gl.deleteBuffer(buffer);
        }
    }

    async makeMesh({ centre, radius, parts }) {
        const ball = { centre, radius };
        return { ball, parts: await Promise.all(parts.map((part) => this.makePart(part, ball))) };
    }

    async makePart({ positions, normals, tangents, coordinates, triangles }, { centre, radius }) {
        const { gl } = this;
        const vectors = [positions, normals, tangents].map(async (numbers) => {
            return Float32Array.from(new Int16Array((await numbersBlob(numbers)).buffer), (word) => word / 32767);
        });
        const [corners, places, ...attributes] = await Promise.all([numbersBlob(triangles), ...vectors]);
        places.forEach((unit, i) => { places[i] = centre[i % 3] + radius * unit; });
        attributes.unshift(places);
        if (coordinates) {
            const { buffer } = await numbersBlob(coordinates);
            attributes.push(Float32Array.from(new Int32Array(buffer), (step) => step / 65536));
        }
        const indices = Uint32Array.from(corners);
        const array = gl.createVertexArray();
        const buffers = [...attributes, indices].map(() => gl.createBuffer());
        gl.bindVertexArray(array);
        for (const [location, numbers] of attributes.entries()) {
            gl.bindBuffer(gl.ARRAY_BUFFER, buffers[location]);
            gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
            gl.enableVertexAttribArray(location);
            gl.vertexAttribPointer(location, location < 3 ? 3 : 2, gl.FLOAT, false, 0, 0);
        }
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers.at(-1));
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
        gl.bindVertexArray(null);
        return { array, buffers, count: indices.length };
    }

    // ---- frames

    /** A program with what it reads. */
    async pass(said) {
        const { textures, blocks, uniforms } = said;
        const [names, blockNames] = [textures, blocks].map(Object.keys);
        const [program, contents, ...made] = await Promise.all([
            this.program(said),
            Promise.all(blockNames.map((name) => numbersBlob(blocks[name]))),
            ...names.map((name) => this.texture(textures[name])),
        ]);
        const missing = program.samplers.find((name) => !(name in textures));
        if (missing) throw new Error(`The shader reads ${missing}, which the page does not have.`);
        const named = (keys, values) => Object.fromEntries(keys.map((name, i) => [name, values[i]]));
        return { program, uniforms, textures: named(names, made), blocks: named(blockNames, contents) };
    }

    /**
     * Loads all that a picture needs. What cannot be loaded is null, and `problems` says why; `isGone` is
     * whether a part does not exist any more.
     *
     * `mesh` and `sky` are promises of entries, `sky` is null for none, and `views` has one or two promises
     * of views, a list with one for each part of the mesh, each with the `label` of its form.
     */
    async assemble({ mesh, sky, views, isDifference }) {
        const problems = [];
        let isGone = false;
        const attempt = (what, loading) => loading.catch((error) => {
            problems.push(`${what}: ${error.message}`);
            isGone ||= error.isGone;
            return null;
        });
        const [loadedMesh, depth, skyPass, differenceProgram, ...sides] = await Promise.all([
            attempt('mesh', mesh.then((said) => this.mesh(said))),
            attempt('depth', this.program(data.depth)),
            sky && attempt('background', sky.then((said) => this.pass(said))),
            isDifference ? attempt('difference', this.program(data.difference)) : null,
            ...views.map(({ label, view }) => attempt(label, view.then((parts) => {
                return Promise.all(parts.map((said) => this.pass(said)));
            }))),
        ]);
        await this.trimTextures([skyPass, ...sides.flat()].filter(Boolean));
        const programs = { depth, differenceProgram };
        return { mesh: loadedMesh, sky: skyPass, sides, isDifference, ...programs, problems, isGone };
    }

    /** Draws a picture with the camera of a state, over a grey of three shares of one. */
    draw(picture, state, grey) {
        const { gl } = this;
        const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
        const page = {
            ...cameraUniforms(state, picture.mesh?.ball ?? UNIT_BALL, width, height),
            'page.gain': 2 ** (picture.exposure + state.exposure),
            'page.tone': state.tone === 'filmic' ? 1 : 0,
            'page.amplify': state.amplify,
        };
        gl.viewport(0, 0, width, height);
        if (picture.isDifference) {
            this.drawDifference(picture, page, width, height, grey);
        } else {
            this.dropTargets();
            this.drawSides(picture, page, width, height, grey, state.divide);
        }
    }

    drawSides({ mesh, depth, sky, sides }, page, width, height, grey, divide) {
        const { gl } = this;
        this.clear(null, [...grey, 1]);
        if (sky) this.drawScreen(sky, page);
        this.drawDepth(mesh, depth, page);
        const middle = sides.length === 2 ? Math.round(divide * width) : width;
        gl.enable(gl.SCISSOR_TEST);
        for (const [side, passes] of sides.entries()) {
            gl.scissor(side * middle, 0, side ? width - middle : middle, height);
            this.drawMesh(mesh, passes, page);
        }
        gl.disable(gl.SCISSOR_TEST);
    }

    drawDifference({ mesh, depth, sides, differenceProgram }, page, width, height, grey) {
        const { gl } = this;
        const { framebuffers, first, second } = this.targetsOf(width, height);
        for (const [side, passes] of sides.entries()) {
            this.clear(framebuffers[side], [0, 0, 0, 0]);
            this.drawDepth(mesh, depth, page);
            this.drawMesh(mesh, passes, { ...page, 'page.raw': 1 });
        }
        this.clear(null, [...grey, 1]);
        if (!mesh || !differenceProgram || sides.includes(null)) return;
        const textures = { first_picture: first, second_picture: second };
        this.drawScreen({ program: differenceProgram, textures, blocks: {}, uniforms: {} }, page);
    }

    clear(framebuffer, colour) {
        const { gl } = this;
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.clearColor(...colour);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    }

    drawDepth(mesh, program, page) {
        const { gl } = this;
        if (!mesh || !program) return;
        const pass = { program, textures: {}, blocks: {}, uniforms: {} };
        gl.colorMask(false, false, false, false);
        this.drawMesh(mesh, mesh.parts.map(() => pass), page);
        gl.colorMask(true, true, true, true);
    }

    /** Draws the parts of a mesh, each by its pass. */
    drawMesh(mesh, passes, page) {
        const { gl } = this;
        if (!mesh || !passes) return;
        gl.enable(gl.DEPTH_TEST);
        for (const [i, { array, count }] of mesh.parts.entries()) {
            this.use(passes[i], page);
            gl.bindVertexArray(array);
            gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
        }
    }

    drawScreen(pass, page) {
        const { gl } = this;
        this.use(pass, page);
        gl.disable(gl.DEPTH_TEST);
        gl.bindVertexArray(this.nothing);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** Makes a pass' program, textures and uniforms current. */
    use({ program, textures, blocks, uniforms }, page) {
        const { gl } = this;
        gl.useProgram(program.handle);
        for (const [unit, name] of program.samplers.entries()) {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(textures[name].target, textures[name].handle);
        }
        const values = { ...uniforms, ...page };
        for (const [binding, block] of program.blocks.entries()) {
            gl.bindBufferBase(gl.UNIFORM_BUFFER, binding, block.buffer);
            const content = blocks[block.name] ?? blockContent(block, values);
            gl.bufferData(gl.UNIFORM_BUFFER, content, gl.DYNAMIC_DRAW);
        }
    }

    /** Waits until the device has drawn everything so far; false if it was lost. */
    async finished() {
        const { gl } = this;
        const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        while (sync && !gl.isContextLost()) {
            const status = gl.clientWaitSync(sync, 0, 0);
            if (status === gl.ALREADY_SIGNALED || status === gl.CONDITION_SATISFIED) break;
            await new Promise((resolve) => setTimeout(resolve, 4));
        }
        gl.deleteSync(sync);
        return !gl.isContextLost();
    }

    // ---- the targets of a difference

    get hasDifference() {
        return this.targetFormats.length > 0;
    }

    targetsOf(width, height) {
        if (this.targets?.width === width && this.targets.height === height) return this.targets;
        this.dropTargets();
        const { gl } = this;
        const depth = gl.createRenderbuffer();
        gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
        gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
        const [first, second] = [1, 2].map(() => ({ handle: null, target: gl.TEXTURE_2D }));
        const framebuffers = [first, second].map((texture) => {
            const framebuffer = gl.createFramebuffer();
            gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
            gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
            // Some devices have a format and cannot draw into it.
            for (const format of this.targetFormats) {
                gl.deleteTexture(texture.handle);
                texture.handle = gl.createTexture();
                gl.bindTexture(gl.TEXTURE_2D, texture.handle);
                gl.texStorage2D(gl.TEXTURE_2D, 1, gl[format], width, height);
                this.sample(gl.TEXTURE_2D, gl.NEAREST);
                const { handle, target } = texture;
                gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, target, handle, 0);
                if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) === gl.FRAMEBUFFER_COMPLETE) break;
            }
            return framebuffer;
        });
        this.targets = { width, height, depth, first, second, framebuffers };
        return this.targets;
    }

    dropTargets() {
        if (!this.targets) return;
        const { gl } = this;
        const { depth, first, second, framebuffers } = this.targets;
        for (const framebuffer of framebuffers) gl.deleteFramebuffer(framebuffer);
        for (const texture of [first, second]) gl.deleteTexture(texture.handle);
        gl.deleteRenderbuffer(depth);
        this.targets = null;
    }
}
