'use strict';

// The data of the page, its blobs, and the state that the address holds.

const data = JSON.parse(document.getElementById('page-data').textContent);

const unpacking = new Map();

/**
 * The bytes of a blob: of the element that holds them, or else of a file beside the page.
 *
 * Requests at the same time share one result. It is not kept, as what is made from it is.
 */
function blob(index) {
    let bytes = unpacking.get(index);
    if (!bytes) {
        bytes = unpack(index).finally(() => unpacking.delete(index));
        unpacking.set(index, bytes);
    }
    return bytes;
}

async function unpack(index) {
    const element = document.getElementById(`blob-${index}`);
    const packed = element ? new Response(fromBase64(element.textContent)) : await request(`blob/${index}`);
    return new Response(packed.body.pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();
}

/** What is beside the page, or the answer of its server. An error has the server's words. */
async function request(place, options) {
    const response = await fetch(place, options);
    if (response.ok) return response;
    const said = await response.text();
    const error = new Error(said.trim() || `${place}: ${response.status}`);
    throw Object.assign(error, { isGone: response.status === 404 });
}

function fromBase64(text) {
    if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
    const letters = atob(text);
    const bytes = new Uint8Array(letters.length);
    for (let i = 0; i < bytes.length; i++) bytes[i] = letters.charCodeAt(i);
    return bytes;
}

async function textBlob(index) {
    return new TextDecoder().decode(await blob(index));
}

/**
 * The numbers of a blob, of 1, 2 or 4 bytes, whose components take turns.
 *
 * It has the differences of each from the one before of its component: for each of their bytes, the highest
 * first, and for each component, those of all.
 */
async function numbersBlob({ blob: index, words: [width, components] }) {
    const planes = new Uint8Array(await blob(index));
    const count = planes.length / width;
    const numbers = new { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array }[width](count);
    const length = count / components;
    for (let component = 0; component < components; component++) {
        let number = 0;
        for (let i = 0; i < length; i++) {
            let difference = 0;
            for (let byte = 0; byte < width; byte++) {
                difference = (difference << 8) | planes[(byte * components + component) * length + i];
            }
            number = (number + difference) | 0;
            numbers[i * components + component] = number;
        }
    }
    return numbers;
}

/**
 * The texts that the state can have, of which the first is the default.
 *
 * '' is the first form of a pair as `mode`, no form as `compare`, and the system's theme as `theme`.
 */
const CHOICES = {
    material: data.materials,
    environment: data.environments.map(({ name }) => name),
    mesh: data.meshes.map(({ name }) => name),
    mode: ['', ...data.modes.map(({ name }) => name)],
    compare: ['', ...data.modes.map(({ name }) => name)],
    show: ['split', 'difference'],
    tone: ['filmic', 'plain'],
    background: ['on', 'off'],
    theme: ['', 'light', 'dark'],
};

/** The numbers of the state. Angles are in radians; those without bounds return after a turn. */
const NUMBERS = {
    divide: { start: 0.5, least: 0, most: 1 },
    amplify: { start: 8, least: 1, most: 256 },
    yaw: { start: 0 },
    pitch: { start: 0.2, least: -Math.PI / 2, most: Math.PI / 2 },
    zoom: { start: 1, least: 0.2, most: 20 },
    turn: { start: 0 },
    tilt: { start: 0 },
    exposure: { start: 0, least: -6, most: 6 },
};

/** The mesh whose parts have their coordinates in the textures of these materials, if there are any. */
function withCoordinates(mesh, materials) {
    const parts = mesh.parts.map(({ coordinates, ...part }, i) => {
        return { ...part, coordinates: coordinates[materials[i]] };
    });
    return { ...mesh, parts };
}

const viewsOf = (state) => sceneOf(state)?.views ?? [];

const formOf = (view) => data.modes[view.mode];
const labelOf = (form) => data.modes.find(({ name }) => name === form).label;

/** The names of the forms that there are of the state's pair. */
const formsOf = (state) => viewsOf(state).map((view) => formOf(view).name);

/** The view that a form's name stands for, or undefined. */
function viewOf(state, name) {
    return viewsOf(state).find((view) => formOf(view).name === name);
}

/** Replaces what a state cannot have as far as that is known, and returns sentences about it. */
function settle(state) {
    const notices = [];
    for (const [field, names] of Object.entries(CHOICES)) {
        if (!names.length || names.includes(state[field])) continue;
        const kind = { mode: 'form', compare: 'form' }[field] ?? field;
        if (state[field]) notices.push(`There is no ${kind} “${state[field]}”.`);
        state[field] = names[0];
    }
    for (const [field, { start, least, most }] of Object.entries(NUMBERS)) {
        let value = Number.isFinite(state[field]) ? state[field] : start;
        if (least === undefined) value -= 2 * Math.PI * Math.ceil(value / (2 * Math.PI) - 0.5);
        else value = Math.min(Math.max(value, least), most);
        state[field] = value;
    }
    const [scene, forms] = [sceneOf(state), formsOf(state)];
    for (const [field, otherwise] of [['mode', forms[0] ?? ''], ['compare', '']]) {
        if (!scene || forms.includes(state[field])) continue;
        if (state[field]) {
            const label = labelOf(state[field]);
            notices.push(`There is no ${label} of ${state.material} under ${state.environment}.`);
        }
        state[field] = otherwise;
    }
    if (state.compare === state.mode) state.compare = '';
    return notices;
}

/** The state that an address stands for, before it is settled. */
function readFragment(fragment) {
    const said = new URLSearchParams(fragment.replace(/^#/, ''));
    const state = {};
    for (const [field, names] of Object.entries(CHOICES)) state[field] = said.get(field) ?? names[0] ?? '';
    for (const [field, { start }] of Object.entries(NUMBERS)) {
        state[field] = said.has(field) ? parseFloat(said.get(field)) : start;
    }
    return state;
}

/** The fragment of a settled state, without the fields that have their defaults. */
function writeFragment(state) {
    const said = new URLSearchParams();
    for (const [field, names] of Object.entries(CHOICES)) {
        const usual = field === 'mode' ? formsOf(state)[0] ?? '' : names[0] ?? '';
        if (state[field] !== usual) said.set(field, state[field]);
    }
    for (const [field, { start }] of Object.entries(NUMBERS)) {
        const rounded = Number(state[field].toFixed(4));
        if (rounded !== start) said.set(field, rounded);
    }
    return said.toString();
}
