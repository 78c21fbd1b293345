// The controls, the address, and what happens when they change.

const element = (id) => document.getElementById(id);
const canvas = element('canvas');
const stage = element('stage');

const state = {};
window.specula = { state, drawn: 0 };

const NO_DIFFERENCE = 'This device cannot draw into textures of floats, which differences need.';
const NO_CONTEXT = 'The browser took the graphics device away. The picture returns when the device does.';

let renderer = null; // null while there is no context
let picture = null; // what was loaded last, with the key of the state that it is for
let isLoading = false;
let goneScene = null; // the last that a server has replaced before it was loaded; its next one comes
let isFrameDue = false;
let isDrawing = false;
let isDrawnAgain = false; // whether something changed while a frame was drawn
let wholeSize = [1, 1]; // the canvas in pixels of the device
let frameTime = 800; // ms that a whole frame takes; until one was drawn, as on a slow device
let lastChange = -Infinity;
let sharpenTimer = 0;
let addressTimer = 0;

/** The ms that a frame may take while something moves and at rest, and those of rest before it is sharpened. */
const [MOVING, RESTING, SHARPEN] = [50, 2000, 200];

/** The ms until a coarse picture is drawn again, in case it can be finer by then, and their most. */
const LONGEST_PAUSE = 60000;
let sharpenPause = SHARPEN;

// ---- from the state to the picture

/** Changes the state, and with it the picture, the controls and the address. */
function set(changes) {
    Object.assign(state, changes);
    const notices = [...chooseSubject(changes), ...settle(state)];
    if (state.show === 'difference' && renderer && !renderer.hasDifference) {
        state.show = 'split';
        notices.push(NO_DIFFERENCE);
    }
    if (notices.length) notify(notices.join(' '));
    addressTimer ||= setTimeout(writeAddress, 400);
    lastChange = performance.now();
    sharpenPause = SHARPEN;
    load();
    requestFrame();
}

/** The names of the forms that are shown: none, one or two. */
const shownForms = () => [state.mode, state.compare].filter(Boolean);

const isDifference = () => state.show === 'difference' && state.compare !== '';

/** What the loaded parts of a picture depend on. */
function pictureKey() {
    const { material, environment, mesh, mode, compare, background } = state;
    const number = sceneOf(state)?.number;
    return JSON.stringify([number, material, environment, mesh, mode, compare, background, isDifference()]);
}

const needsPicture = () => renderer !== null && picture?.key !== pictureKey();

/** Loads one picture after the other until it is that of the state, or a server has to send its scene. */
async function load() {
    if (isLoading) return;
    isLoading = true;
    while (needsPicture()) {
        canvas.setAttribute('aria-busy', 'true');
        const scene = sceneOf(state);
        if (!scene || scene === goneScene) break;
        const key = pictureKey();
        const loader = renderer;
        const parts = scene.parts();
        const loaded = await loader.assemble({
            mesh: parts.then(({ mesh }) => mesh),
            sky: state.background === 'on' && !isDifference() ? parts.then(({ sky }) => sky) : null,
            views: shownForms().map((form) => {
                return { label: labelOf(form), view: scene.view(viewOf(state, form)) };
            }),
            isDifference: isDifference(),
        });
        if (loaded.isGone) goneScene = scene;
        if (loader !== renderer || scene === goneScene) continue;
        picture = { ...loaded, key, exposure: scene.exposure, number: scene.number };
        sharpenPause = SHARPEN;
        turnBack(scene);
        requestFrame();
    }
    if (!needsPicture()) canvas.removeAttribute('aria-busy');
    isLoading = false;
}

function requestFrame() {
    if (isFrameDue) return;
    isFrameDue = true;
    requestAnimationFrame(() => {
        isFrameDue = false;
        showState();
        draw();
    });
}

/** Draws one frame, and then what changed meanwhile: a slow device is never given more than one. */
async function draw() {
    if (!renderer || !picture || isDrawing) {
        isDrawnAgain = isDrawing;
        return;
    }
    isDrawing = true;
    const drawer = renderer;
    const share = sizeCanvas();
    const grey = getComputedStyle(canvas).backgroundColor.match(/[\d.]+/g).slice(0, 3);
    const start = performance.now();
    drawer.draw(picture, state, grey.map((code) => code / 255));
    const isFinished = await drawer.finished();
    isDrawing = false;
    if (isFinished) frameTime = (performance.now() - start) / share ** 2;
    if (isDrawnAgain) {
        isDrawnAgain = false;
        requestFrame();
    } else if (share < 1) {
        // A frame also takes long if its programs are new or the machine is busy: later ones may be finer.
        const isSlow = share > 0.8 * shareWithin(RESTING);
        sharpenPause = isSlow ? Math.min(2 * sharpenPause, LONGEST_PAUSE) : SHARPEN;
        clearTimeout(sharpenTimer);
        sharpenTimer = setTimeout(requestFrame, sharpenPause);
    }
    if (!isFinished || picture?.key !== pictureKey() || isFrameDue) return;
    const { dataset } = document.documentElement;
    if (!dataset.ready) {
        dataset.firstPicture = Math.round(performance.now());
        dataset.ready = 'true';
    }
    if (share !== 1) return;
    specula.drawn += 1;
    specula.scene = picture.number;
}

/** The share of the canvas' pixels along an edge that this device draws in so many ms. */
function shareWithin(time) {
    return specula.isExact ? 1 : Math.min(1, Math.max(0.2, Math.sqrt(time / frameTime)));
}

/** Gives the canvas its pixels, and returns the share of them along an edge: fewer on a slow device. */
function sizeCanvas() {
    const share = shareWithin(performance.now() - lastChange < SHARPEN ? MOVING : RESTING);
    const [width, height] = wholeSize.map((size) => Math.max(1, Math.round(size * share)));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    return share;
}

// ---- the address

/** The fragment of the address that the page wrote or read last. */
let address = location.hash;

function writeAddress() {
    clearTimeout(addressTimer);
    addressTimer = 0;
    // Another address was typed, and its event comes later: it is not to be lost.
    if (location.hash !== address) return readAddress();
    const fragment = writeFragment(state);
    if (fragment === location.hash.slice(1)) return;
    try {
        history.replaceState(null, '', fragment ? `#${fragment}` : location.href.replace(/#.*$/, ''));
    } catch {
        location.replace(`#${fragment}`);
    }
    address = location.hash;
}

function readAddress() {
    address = location.hash;
    if (location.hash.slice(1) !== writeFragment(state)) set(readFragment(location.hash));
}

async function copyLink() {
    writeAddress();
    try {
        await navigator.clipboard.writeText(location.href);
        notify('The link is in the clipboard.');
    } catch {
        notify('This browser does not let the page copy. The link is the address of this window.');
    }
}

// ---- from the state to the controls

function setText(target, text) {
    if (target.textContent !== text) target.textContent = text;
}

function make(tag, text, className = '') {
    return Object.assign(document.createElement(tag), { textContent: text, className });
}

/** Shows lines for some seconds, below those of before. */
function notify(...lines) {
    const list = element('notice');
    const notice = make('p', lines.join('\n'));
    const others = [...list.children].filter(({ textContent }) => textContent !== notice.textContent);
    list.replaceChildren(...others.slice(-3), notice);
    setTimeout(() => notice.remove(), 7000 + 1000 * lines.length);
}

/** Gives a list its options, pairs of value and text, if it has others. */
function fill(list, options, value) {
    const key = JSON.stringify(options);
    if (list.optionsKey !== key) {
        list.replaceChildren(...options.map(([name, text]) => new Option(text, name)));
        list.optionsKey = key;
    }
    list.value = value;
    list.disabled = options.length < 2;
}

const bytesText = (bytes) => {
    const kilobytes = bytes / 1000;
    const [value, unit] = kilobytes < 999.5 ? [kilobytes, 'kB'] : [kilobytes / 1000, 'MB'];
    return `${Number(value.toPrecision(value < 100 ? 2 : 3))} ${unit}`;
};
const count = (number, noun) => `${number} ${noun}${number === 1 ? '' : 's'}`;
const stopsText = (stops) => Number(stops.toPrecision(2));
const degreesText = (radians) => `${Math.round(radians * 180 / Math.PI)}°`.replace('-', '−');

function showState() {
    showLists();
    showForms();
    showLines(element('notes'), sceneOf(state)?.notes ?? []);
    showStage(shownForms().map(labelOf));
    showEditor();

    for (const [name, value] of [['show', state.show], ['tone', state.tone]]) {
        for (const radio of document.getElementsByName(name)) radio.checked = radio.value === value;
    }
    element('row-show').hidden = !state.compare;
    element('row-amplify').hidden = !isDifference();
    const difference = document.querySelector('[name=show][value=difference]');
    difference.disabled = renderer !== null && !renderer.hasDifference;
    difference.parentElement.title = difference.disabled ? NO_DIFFERENCE : '';

    const stops = state.exposure.toFixed(2).replace('-', '−');
    showSlider('exposure', state.exposure * 3, `${state.exposure > 0 ? '+' : ''}${stops} stops`);
    showSlider('amplify', Math.log2(state.amplify), `× ${stopsText(state.amplify)}`);
    showSlider('turn', state.turn * 180 / Math.PI, degreesText(state.turn));
    showSlider('tilt', state.tilt * 180 / Math.PI, degreesText(state.tilt));
    element('save-light').disabled = state.turn === 0 && state.tilt === 0;
    const zoom = Number(state.zoom.toPrecision(3));
    setText(element('camera-text'), `${degreesText(state.yaw)}, ${degreesText(state.pitch)}, zoom ${zoom}`);
    element('background').checked = state.background === 'on';

    document.documentElement.dataset.theme = state.theme;
    setText(element('theme'), otherTheme() === 'dark' ? 'Dark theme' : 'Light theme');
}

function showSlider(id, value, text) {
    const slider = element(id);
    slider.value = Math.round(value);
    slider.setAttribute('aria-valuetext', text);
    setText(element(`${id}-text`), text);
}

function showLists() {
    for (const field of ['material', 'environment', 'mesh']) {
        const text = (name) => field === 'material' && isUnsaved(name) ? `${name} *` : name;
        fill(element(field), CHOICES[field].map((name) => [name, text(name)]), state[field]);
    }
    for (const button of document.querySelectorAll('[data-step]')) {
        button.disabled = CHOICES[button.dataset.field].length < 2;
    }
    if (!sceneOf(state)) return;
    const text = ({ bytes, ...view }) => formOf(view).label + (bytes ? `, ${bytesText(bytes)}` : '');
    const forms = viewsOf(state).map((view) => [formOf(view).name, text(view)]);
    const others = forms.filter(([name]) => name !== state.mode);
    fill(element('mode'), forms, state.mode);
    fill(element('compare'), [['', 'nothing'], ...others], state.compare);
}

/** What stops were measured over, by what measured them. */
const MEASURED_BY = {
    report: 'over all views, as the report measured',
    page: 'in one view of a sphere, as this page measured',
};

/** The lines about each shown form, which are also read aloud when they change. */
function showForms() {
    const scene = sceneOf(state);
    if (!scene) return;
    const views = shownForms().map((form) => viewOf(state, form));
    const forms = views.map((view, side) => {
        const { label } = formOf(view);
        const { bytes, error, fetches, lights, note } = view;
        const cost = fetches !== undefined
            && `${count(fetches, 'texel')}${lights ? ` and ${count(lights, 'light')}` : ''} a pixel`;
        const within = error && `95 % within ${stopsText(error.p95)} stops, 99 % within `
            + `${stopsText(error.p99)} ${MEASURED_BY[error.by]}`;
        const places = isDifference() ? ['first', 'second'] : ['left', 'right'];
        const place = views.length < 2 ? '' : places[side];
        return { label, place, lines: [bytes && bytesText(bytes), within, cost].filter(Boolean), note };
    });
    const list = element('forms');
    const key = JSON.stringify(forms);
    if (list.formsKey === key) return;
    list.formsKey = key;
    list.replaceChildren(...forms.map(({ label, place, lines, note }) => {
        const form = make('div', '', 'form');
        const heading = make('h3', label);
        if (place) heading.append(' ', make('span', place));
        form.append(heading, ...lines.map((line) => make('p', line)));
        if (note) form.append(make('p', note, 'soft'));
        return form;
    }));
    if (!forms.length) {
        list.append(make('p', `The page has no ${state.material} under ${state.environment}.`, 'form'));
    }
}

/** Gives a list at the end of the panel its lines; without one it is hidden. */
function showLines(list, lines) {
    const key = JSON.stringify(lines);
    if (list.linesKey === key) return;
    list.linesKey = key;
    list.hidden = !lines.length;
    list.querySelector('ul').replaceChildren(...lines.map((line) => make('li', line)));
}

/** The texts and the divider over the canvas. */
function showStage(labels) {
    const isSplit = labels.length === 2 && !isDifference();
    const percent = Math.round(state.divide * 100);
    const amplified = `× ${stopsText(state.amplify)}`;
    setText(element('caption-left'), isDifference() ? `Difference ${amplified}` : labels[0] ?? '');
    setText(element('caption-right'), isSplit ? labels[1] : '');

    const divider = element('divider');
    divider.hidden = !isSplit;
    divider.style.left = `${state.divide * 100}%`;
    divider.setAttribute('aria-label', `Divider between ${labels.join(' and ')}`);
    divider.setAttribute('aria-valuenow', percent);
    divider.setAttribute('aria-valuetext', `${percent} % for the left side`);

    let forms = labels[0] ?? 'nothing';
    if (isSplit) forms = `${labels[0]} on the left, ${labels[1]} on the right`;
    if (isDifference()) forms = `difference ${amplified} between ${labels.join(' and ')}`;
    const { mesh, material, environment } = state;
    const text = material ? `${mesh} of ${material} under ${environment}: ${forms}` : 'no picture yet';
    if (canvas.getAttribute('aria-label') !== text) canvas.setAttribute('aria-label', text);

    const problems = renderer ? picture?.problems ?? [] : [NO_CONTEXT];
    setText(element('problem'), [...serverProblems(), ...problems].join('\n\n'));
}

// ---- from the controls to the state

/** The neighbour of a field's value in a list, which goes round. */
function neighbour(names, name, step) {
    return names[(names.indexOf(name) + step + names.length) % names.length];
}

function step(field, by) {
    set({ [field]: neighbour(CHOICES[field], state[field], by) });
}

/** Shows another form; if it is the one that is compared with, the two change sides. */
function showForm(mode) {
    set({ mode, compare: mode === state.compare ? state.mode : state.compare });
}

function nextForm(from) {
    return neighbour(formsOf(state), from, 1) ?? '';
}

let lastCompared = '';

/** Compares with the form of the last time, or with the next. */
function toggleCompare(changes = {}) {
    if (state.compare) lastCompared = state.compare;
    const isStill = lastCompared !== state.mode && formsOf(state).includes(lastCompared);
    const other = isStill ? lastCompared : nextForm(state.mode);
    set({ ...changes, compare: state.compare ? '' : other });
}

function toggleDifference() {
    if (!state.compare) toggleCompare({ show: 'difference' });
    else set({ show: state.show === 'split' ? 'difference' : 'split' });
}

const systemIsDark = matchMedia('(prefers-color-scheme: dark)');

function otherTheme() {
    const theme = state.theme || (systemIsDark.matches ? 'dark' : 'light');
    return theme === 'dark' ? 'light' : 'dark';
}

const movements = {
    orbit: (x, y) => {
        const angle = Math.PI / Math.max(1, state.zoom);
        set({ yaw: state.yaw - x * angle, pitch: state.pitch + y * angle });
    },
    turn: (x, y) => set({ turn: state.turn + x * Math.PI, tilt: state.tilt + y * Math.PI }),
    zoom: (factor) => set({ zoom: state.zoom * factor }),
    reset: () => set(defaultsOf(['yaw', 'pitch', 'zoom', 'turn', 'tilt'])),
};

function defaultsOf(fields) {
    return Object.fromEntries(fields.map((field) => [field, NUMBERS[field].start]));
}

const changeExposure = (thirds) => set({ exposure: Math.round(state.exposure * 3 + thirds) / 3 });

/** What keys do while the canvas has the focus. */
const KEYS = {
    '+': () => movements.zoom(1.1),
    '=': () => movements.zoom(1.1),
    '-': () => movements.zoom(1 / 1.1),
    '[': () => step('material', -1),
    ']': () => step('material', 1),
    'e': () => step('environment', 1),
    'E': () => step('environment', -1),
    'm': () => showForm(nextForm(state.mode)),
    'c': () => toggleCompare(),
    'd': toggleDifference,
    't': () => step('tone', 1),
    ',': () => changeExposure(-1),
    '.': () => changeExposure(1),
    '0': () => set(defaultsOf(['yaw', 'pitch', 'zoom', 'turn', 'tilt', 'exposure'])),
    '?': () => element('keys').showModal(),
};

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function pressKey(event) {
    const isOfBrowser = event.ctrlKey || event.metaKey || event.altKey;
    if (isOfBrowser && !event.getModifierState('AltGraph')) return;
    const arrow = ARROWS[event.key];
    if (!arrow && !Object.hasOwn(KEYS, event.key)) return;
    event.preventDefault();
    if (arrow) movements[event.shiftKey ? 'turn' : 'orbit'](arrow[0] / 36, arrow[1] / 36);
    else KEYS[event.key]();
}

function connectDivider() {
    const divider = element('divider');
    divider.addEventListener('pointerdown', (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener('pointermove', (event) => {
        if (!divider.hasPointerCapture(event.pointerId)) return;
        const { left, width } = stage.getBoundingClientRect();
        set({ divide: (event.clientX - left) / width });
    });
    divider.addEventListener('keydown', (event) => {
        const by = event.shiftKey ? 0.1 : 0.01;
        const moved = {
            ArrowLeft: state.divide - by,
            ArrowDown: state.divide - by,
            ArrowRight: state.divide + by,
            ArrowUp: state.divide + by,
            Home: 0,
            End: 1,
        }[event.key];
        if (moved === undefined) return;
        event.preventDefault();
        set({ divide: moved });
    });
}

function connectControls() {
    for (const field of ['material', 'environment', 'mesh', 'compare']) {
        element(field).addEventListener('change', (event) => set({ [field]: event.target.value }));
    }
    element('mode').addEventListener('change', (event) => showForm(event.target.value));
    for (const field of ['show', 'tone']) {
        for (const radio of document.getElementsByName(field)) {
            radio.addEventListener('change', () => set({ [field]: radio.value }));
        }
    }
    for (const button of document.querySelectorAll('[data-step]')) {
        button.addEventListener('click', () => step(button.dataset.field, Number(button.dataset.step)));
    }
    const meanings = {
        exposure: (value) => value / 3,
        amplify: (value) => 2 ** value,
        turn: (value) => value * Math.PI / 180,
        tilt: (value) => value * Math.PI / 180,
    };
    for (const [field, meaning] of Object.entries(meanings)) {
        element(field).addEventListener('input', (event) => {
            set({ [field]: meaning(event.target.valueAsNumber) });
        });
    }
    element('background').addEventListener('change', (event) => {
        set({ background: event.target.checked ? 'on' : 'off' });
    });
    element('reset').addEventListener('click', movements.reset);
    element('copy').addEventListener('click', copyLink);
    element('theme').addEventListener('click', () => {
        const theme = otherTheme();
        set({ theme: (theme === 'dark') === systemIsDark.matches ? '' : theme });
    });
    element('help').addEventListener('click', () => element('keys').showModal());
    element('fold').addEventListener('click', () => {
        const isFolded = element('viewer').toggleAttribute('data-folded');
        element('fold').setAttribute('aria-expanded', !isFolded);
        setText(element('fold'), isFolded ? 'Show controls' : 'Hide controls');
    });
    systemIsDark.addEventListener('change', requestFrame);
    window.addEventListener('hashchange', readAddress);
    canvas.addEventListener('keydown', pressKey);
    followPointers(canvas, movements);
    connectDivider();

    showLines(element('left-out'), data.left_out);
}

/** Gives the canvas one pixel for each of the device, but at most two across one of CSS. */
function followSize() {
    const resize = () => {
        const box = canvas.getBoundingClientRect();
        const scale = Math.min(devicePixelRatio, 2);
        const [width, height] = [box.width, box.height].map((size) => Math.max(1, Math.round(size * scale)));
        wholeSize = [width, height];
        draw();
    };
    new ResizeObserver(resize).observe(canvas);
    window.addEventListener('resize', resize); // which also says that the window has come to another screen
}
