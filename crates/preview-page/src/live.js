// A page that a server fills: its events, what is posted to it, and the controls that only such a page has.

const SUBJECT = ['material', 'environment', 'mesh'];

const LOST = 'The connection to the server is lost; trying again.';
const ENDED = 'The server has ended.';

let catalog = null; // the names that there are; null before the first
let chosen = {}; // what the server chooses with the next catalog
let wanted = {}; // the subject chosen last; if the catalog lacks it, the state has the nearest instead
let asked = []; // the fields of it that were chosen last
let followed = null; // the catalog that the state's subject is of
let posted = {}; // the subject that the server was asked for last
let mark = ''; // that of the last request for a subject, until the server has told all pages of it
let sent = null; // the latest scene
let savedTurn = null; // a turn of the light that scenes after a number have of their own
let connection = ''; // what is wrong with the connection
let failure = null; // the lines of what is wrong in the project
const lacked = {}; // by field, the form that a scene lacked, and the one that is shown instead

// ---- to the server

const JSON_TYPE = { 'content-type': 'application/json' };
const outbox = new Map(); // what waits to be posted, by key
let isPosting = false;

/** Posts one body after the other. One that waits is replaced by the next of its key. */
async function send(place, body, key = place) {
    outbox.delete(key);
    outbox.set(key, [place, body]);
    if (isPosting) return;
    isPosting = true;
    for (const [key, [place, body]] of outbox) {
        outbox.delete(key);
        const letter = { method: 'POST', headers: JSON_TYPE, body: JSON.stringify(body) };
        const isSent = await attempt(place, () => request(place, letter));
        if (!isSent && body?.mark === mark) mark = '';
    }
    isPosting = false;
}

/** Whether something was done; if not, a notice says why. */
async function attempt(what, act) {
    try {
        await act();
        return true;
    } catch (error) {
        notify(`“${what}” failed: ${error.message}`);
        return false;
    }
}

// ---- the subject

/** Takes the subject nearest to the chosen one, asks for it, and returns a sentence if it is another. */
function chooseSubject(changes) {
    const changed = SUBJECT.filter((field) => changes[field] && changes[field] !== posted[field]);
    if (!catalog || (!changed.length && followed === catalog)) return [];
    followed = catalog;
    if (changed.length) {
        wanted = subjectOf(state);
        asked = changed;
    }
    const subject = nearestSubject();
    if (!subject) return [];
    Object.assign(state, subject);
    if (SUBJECT.every((field) => subject[field] === posted[field])) return [];
    posted = subject;
    mark = `${Math.random()}`;
    send('show', { ...subject, mark });
    return whyReplaced(subject);
}

/** Shows the subject of another page, unless this one has asked for another since: a server has one subject. */
function followSubject({ mark: found, ...subject }) {
    const isOwn = found === mark;
    if (isOwn) mark = '';
    if (mark) return;
    const isShown = SUBJECT.every((field) => subject[field] === state[field]);
    if (isOwn && isShown) return;
    wanted = posted = subject;
    asked = [];
    if (isShown) return;
    set(subject);
    notify(`Another page shows ${subject.material} under ${subject.environment}.`);
}

const subjectOf = ({ material, environment, mesh }) => ({ material, environment, mesh });

/** The fields that have a name. */
const named = (fields) => Object.fromEntries(Object.entries(fields).filter(([, name]) => name));

/**
 * The subject that differs least from the wanted one. What was asked for counts twice. Of several, it is the
 * one that differs less from that of the state, then the first.
 */
function nearestSubject() {
    const pairs = catalog.pairs.map(([environment, material]) => {
        return { material: catalog.materials[material], environment: catalog.environments[environment] };
    });
    const lacks = (pair, subject, weight) => ['material', 'environment'].reduce((sum, field) => {
        return sum + (pair[field] === subject[field] ? 0 : weight(field));
    }, 0);
    const weight = (field) => asked.includes(field) ? 2 : 1;
    const distance = (pair) => 4 * lacks(pair, wanted, weight) + lacks(pair, state, () => 1);
    const [first] = pairs.sort((one, other) => distance(one) - distance(other));
    const meshes = [wanted.mesh, state.mesh, ...catalog.meshes];
    return first && { ...first, mesh: meshes.find((name) => catalog.meshes.includes(name)) ?? '' };
}

/** Why this subject replaces the wanted one, or nothing. */
function whyReplaced({ material, environment }) {
    const missing = SUBJECT.filter((field) => wanted[field] && !CHOICES[field].includes(wanted[field]));
    const names = missing.map((field) => wanted[field]).join(', ');
    if (names) return [`${names} is not in this pipeline.`];
    const agrees = (found, field) => !wanted[field] || wanted[field] === found;
    if (agrees(material, 'material') && agrees(environment, 'environment')) return [];
    return [`No stage reflects ${wanted.environment} off ${wanted.material}.`];
}

// ---- the scene

/** The scene of a state's subject, as file.js has it, or undefined while the server has not sent it. */
function sceneOf(state) {
    return sent && SUBJECT.every((field) => sent[field] === state[field]) ? sent : undefined;
}

/** The scene of an event. Its parts and the rest of its views are loaded when they are first needed. */
function makeScene({ forms, ...said }) {
    const loading = new Map();
    const load = (place) => kept(loading, place, async () => {
        const response = await request(place);
        if (response.status !== 204) return response.json();
        throw Object.assign(new Error('A newer scene comes.'), { isGone: true });
    });
    const place = `scene/${said.number}`;
    const views = forms.map((form) => {
        return { ...form, mode: data.modes.findIndex(({ name }) => name === form.mode) };
    });
    return {
        ...said,
        views,
        parts: async () => {
            const { mesh, sky } = await load(place);
            // Each part has one material.
            return { mesh: withCoordinates(mesh, mesh.parts.map(() => 0)), sky };
        },
        view: async (view) => {
            const { parts, ...cost } = await load(`${place}/${formOf(view).name}`);
            Object.assign(view, cost);
            return parts;
        },
    };
}

/** Shows the chosen forms in a new scene, also those that the scene before lacked. */
function followForms() {
    const forms = formsOf(state);
    const tried = { mode: state.mode, compare: state.compare };
    for (const [field, { form, instead }] of Object.entries(lacked)) {
        if (state[field] !== instead) delete lacked[field];
        else if (!form || forms.includes(form)) tried[field] = form;
    }
    set(tried);
    for (const [field, form] of Object.entries(tried)) {
        if (form !== state[field]) lacked[field] = { form, instead: state[field] };
    }
}

/** Turns the light back by what was saved, once a scene is shown whose own light is turned by it. */
function turnBack(scene) {
    if (!savedTurn || scene.number <= savedTurn.after) return;
    const { yaw, pitch } = savedTurn;
    savedTurn = null;
    set({ turn: state.turn - yaw, tilt: state.tilt - pitch });
}

// ---- from the server

const EVENTS = {
    catalog: (said) => {
        // At first, what the address does not say is as the server has it.
        if (!catalog) chosen = named({ mode: said.mode, ...said.shown, ...named(state), ...chosen });
        catalog = said;
        CHOICES.material = said.materials;
        CHOICES.environment = said.environments;
        CHOICES.mesh = said.meshes;
        const changes = chosen;
        chosen = {};
        set(changes);
    },
    choose: (said) => { chosen = named(said); },
    shown: followSubject,
    scene: (said) => {
        const isOfState = SUBJECT.every((field) => said[field] === state[field]);
        if (!isOfState && sceneOf(state)) return;
        sent = makeScene(said);
        if (isOfState) followForms();
    },
    material: followMaterial,
    saved: followSaved,
    light: askForLight,
    'light-saved': (turn) => { savedTurn = { ...turn, after: sent?.number ?? -1 }; },
    status: (line) => setText(element('status'), line),
    toast: ({ title, lines }) => notify(title, ...lines),
    failure: (lines) => { failure = lines; },
};

function connect() {
    const source = new EventSource('events');
    for (const [name, follow] of Object.entries(EVENTS)) {
        source.addEventListener(name, (event) => {
            follow(JSON.parse(event.data));
            requestFrame();
        });
    }
    source.addEventListener('open', () => {
        if (connection && picture?.problems.length) picture.key = ''; // what was not loaded may be there now
        connection = '';
        if (!isPosting) mark = ''; // the server may have told of it meanwhile
        load();
        requestFrame();
    });
    source.addEventListener('error', () => {
        connection = source.readyState === EventSource.CLOSED ? ENDED : LOST;
        requestFrame();
    });
    source.addEventListener('close', () => {
        source.close();
        connection = ENDED;
        requestFrame();
    });
    connectLive();
    connectEditor();
}

/** What is wrong with the connection, and in the project. */
function serverProblems() {
    return [connection, failure?.join('\n')].filter(Boolean);
}

// ---- the controls

/** Asks whether to write a turn of the light. */
function askForLight({ yaw, pitch, lines }) {
    const dialog = element('light');
    if (dialog.open) return;
    const [question, ...changes] = lines;
    setText(element('heading-light'), question);
    setText(element('light-text'), changes.join('\n'));
    dialog.returnValue = '';
    dialog.onclose = () => {
        if (dialog.returnValue === 'write') send('save-light', { yaw, pitch, lines });
    };
    dialog.showModal();
}

function connectLive() {
    for (const part of document.querySelectorAll('[data-live]')) part.hidden = false;
    element('save-light').addEventListener('click', () => {
        send('light', { yaw: state.turn, pitch: state.tilt });
    });
    element('back').addEventListener('click', () => {
        send('return', {});
        element('back').hidden = true;
        element('material').focus();
    });
    const isOfFiles = (event) => event.dataTransfer?.types.includes('Files');
    const mark = (isOver) => { element('drop').hidden = !isOver; };
    window.addEventListener('dragover', (event) => {
        if (!isOfFiles(event)) return;
        event.preventDefault();
        mark(true);
    });
    window.addEventListener('dragleave', (event) => {
        if (!event.relatedTarget) mark(false);
    });
    window.addEventListener('drop', (event) => {
        if (!isOfFiles(event)) return;
        event.preventDefault();
        mark(false);
        sendFiles([...event.dataTransfer.files]);
    });
}

/** Sends dropped files, and asks the server to show those that it took. */
async function sendFiles(files) {
    const names = [];
    for (const body of files) {
        const { name } = body;
        const put = () => request(`file/${encodeURIComponent(name)}`, { method: 'PUT', body });
        if (await attempt(name, put)) names.push(name);
    }
    if (!names.length) return;
    send('dropped', names);
    element('back').hidden = false;
}
