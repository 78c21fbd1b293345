// The editor of the shown material: its values in the file and in the page, and the steps between them.

const CHANNELS = ['red', 'green', 'blue'];

/** Ranges that end above this have a logarithmic slider, and those whose ends are this far apart. */
const MIN_LOGARITHMIC = 1000;

/** What a logarithmic slider has next to 0. */
const SMALLEST_POSITIVE = 1e-3;

/** The positions of a slider. */
const POSITIONS = 1000;

const isSame = (one, other) => JSON.stringify(one) === JSON.stringify(other);
const valuesOf = (form) => form.sections.map(({ fields }) => fields.map(({ value }) => value));

/** A form with other values, by sections. */
function withValues(form, values) {
    const sections = form.sections.map(({ heading, fields }, s) => {
        return { heading, fields: fields.map((field, f) => ({ ...field, value: values[s][f] })) };
    });
    return { ...form, sections };
}

/** A form without its values. */
const parametersOf = (form) => withValues(form, form.sections.map(() => []));

class MaterialEditor {
    /** The editor of a file. `edited` are unsaved values that the server has. */
    constructor(file, edited) {
        this.file = file; // the form with the values in the file
        this.form = edited ? withValues(file, edited) : file; // and with those in the page
        this.saving = null; // and with those that are being written
        this.past = edited ? [file] : [];
        this.future = [];
        this.dragged = ''; // the parameter whose changes are one step
        this.conflict = null; // the file's new form, or why it has none, while there are unsaved values
    }

    get isEdited() {
        return !isSame(this.form, this.file);
    }

    /** The values to show instead of the file's own. */
    get edited() {
        return this.isEdited ? valuesOf(this.form) : null;
    }

    get canSave() {
        return this.isEdited && !this.conflict;
    }

    /** Sets a value. Until `endDrag`, changes of one parameter are one step. */
    set(section, field, value) {
        const values = valuesOf(this.form);
        values[section][field] = value;
        const form = withValues(this.form, values);
        if (isSame(form, this.form)) return;
        const key = `${section}/${field}`;
        if (this.dragged !== key) this.past.push(this.form);
        this.future = [];
        this.form = form;
        this.dragged = key;
    }

    endDrag() {
        this.dragged = '';
    }

    undo() {
        this.step(this.past, this.future);
    }

    redo() {
        this.step(this.future, this.past);
    }

    step(from, to) {
        this.endDrag();
        if (!from.length) return;
        to.push(this.form);
        this.form = from.pop();
    }

    /** Returns to the values of the file, as a step that can be undone. */
    revert() {
        this.endDrag();
        if (!this.isEdited) return;
        this.past.push(this.form);
        this.future = [];
        this.form = this.file;
    }

    /** The values to write to the file; null if there is nothing to save, or a conflict. */
    save() {
        this.endDrag();
        if (!this.canSave) return null;
        this.saving = this.form;
        return valuesOf(this.form);
    }

    /** The values of `save` were written, or not. */
    saved(isWritten) {
        if (isWritten && this.saving) this.file = this.saving;
        this.saving = null;
    }

    /** Takes the file's form. With unsaved values in the page, the user has to choose. */
    follow(form, reason) {
        const { saving } = this;
        this.saving = null;
        if (form && [this.form, this.file, saving].some((known) => isSame(known, form))) {
            this.file = form; // it was saved, or is as before
            this.conflict = null;
        } else if (form && !this.isEdited) {
            Object.assign(this, new MaterialEditor(form));
        } else {
            this.conflict = { form, reason };
        }
    }

    /** Whether `keep` is possible: the file has the same parameters as before. */
    get canKeep() {
        const form = this.conflict?.form;
        return Boolean(form) && isSame(parametersOf(form), parametersOf(this.form));
    }

    /** Keeps the unsaved values, to be written over the file's new ones. */
    keep() {
        if (!this.canKeep) return;
        this.file = this.conflict.form;
        this.conflict = null;
    }
}

/** The editors of the materials that were shown, by name, or texts that say why there is none. */
const editors = new Map();

/** The editor of a material, if it can be edited. */
function editorOf(material) {
    const editor = editors.get(material);
    return editor instanceof MaterialEditor ? editor : null;
}

const isUnsaved = (material) => editorOf(material)?.isEdited ?? false;

function makeEditor(material, form, reason, edited) {
    editors.set(material, form ? new MaterialEditor(form, edited) : reason);
}

/** Follows the event about a material's file. */
function followMaterial({ material, form, reason, edited }) {
    const editor = editorOf(material);
    if (editor && (editor.isEdited || form)) editor.follow(form, reason);
    else makeEditor(material, form, reason, edited);
}

/** Follows the event about a material that was to be saved. */
function followSaved({ material, saved }) {
    editorOf(material)?.saved(saved);
}

// ---- what the user does

/** Changes the editor of the shown material, and sends its values if they changed. */
function edit(change) {
    const { material } = state;
    const editor = editorOf(material);
    if (!editor) return;
    const before = editor.edited;
    change(editor);
    const values = editor.edited;
    if (!isSame(before, values)) send('edit', { material, values }, `edit ${material}`);
    requestFrame();
}

function saveMaterial() {
    const { material } = state;
    const values = editorOf(material)?.save();
    if (values) send('save', { material, values }, `save ${material}`);
}

/** Drops the unsaved values in favour of those that the file has now. */
function loadFile() {
    const { material } = state;
    const { form, reason } = editorOf(material).conflict;
    makeEditor(material, form, reason, null);
    send('edit', { material, values: null }, `edit ${material}`);
    requestFrame();
}

const undo = () => edit((editor) => editor.undo());
const redo = () => edit((editor) => editor.redo());
const endDrag = () => edit((editor) => editor.endDrag());

function connectEditor() {
    const actions = {
        'save': saveMaterial,
        'undo': undo,
        'redo': redo,
        'revert': () => edit((editor) => editor.revert()),
        'load-file': loadFile,
        'keep-values': () => edit((editor) => editor.keep()),
    };
    for (const [id, act] of Object.entries(actions)) element(id).addEventListener('click', act);
    document.addEventListener('keydown', pressEditorKey);
    const setField = (section, field, value) => edit((editor) => editor.set(section, field, value));
    specula.editor = { set: setField, undo, save: saveMaterial };
}

/** What keys with Ctrl or Cmd do, unless they belong to a text field. */
function pressEditorKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || !editorOf(state.material)) return;
    if (document.activeElement?.type === 'number') return;
    const chord = (event.shiftKey ? 'shift ' : '') + event.key.toLowerCase();
    const act = { 's': saveMaterial, 'z': undo, 'shift z': redo }[chord];
    if (!act) return;
    event.preventDefault();
    act();
}

// ---- from the editor to the controls

let shownForm = ''; // what the fields were made for
let showFields = () => {};

function showEditor() {
    const editor = editorOf(state.material);
    const reason = editors.get(state.material);
    element('editor').hidden = reason === undefined;
    setText(element('unsaved'), editor?.isEdited ? 'not saved' : '');
    setText(element('editor-reason'), editor ? '' : reason ?? '');
    element('editing').hidden = !editor;
    if (!editor) return;
    element('save').disabled = !editor.canSave;
    element('undo').disabled = !editor.past.length;
    element('redo').disabled = !editor.future.length;
    element('revert').disabled = !editor.isEdited;
    element('conflict').hidden = !editor.conflict;
    setText(element('conflict-reason'), editor.conflict?.reason ?? '');
    element('keep-values').disabled = !editor.canKeep;

    const key = JSON.stringify([state.material, parametersOf(editor.form)]);
    if (key !== shownForm) {
        shownForm = key;
        showFields = makeFields(editor.form);
    }
    showFields(valuesOf(editor.form));
}

/** Makes the controls of a form, and returns a function that shows values in them. */
function makeFields(form) {
    const shows = [];
    const sections = form.sections.map(({ heading, fields }, s) => {
        const section = make('div', '');
        section.append(make('h3', heading));
        for (const [f, field] of fields.entries()) {
            const change = (value) => edit((editor) => editor.set(s, f, value));
            const makeRow = field.is_colour ? makeColour : makeNumber;
            const { row, show } = makeRow(field, `field-${s}-${f}`, change);
            section.append(row);
            shows.push((values) => show(values[s][f]));
        }
        return section;
    });
    element('fields').replaceChildren(...sections);
    return (values) => shows.forEach((show) => show(values));
}

/** The name of a field, in which a line may end after an underscore. */
function makeName(tag, { name, meaning: title }) {
    const [first, ...rest] = name.split(/(?<=_)/);
    const label = Object.assign(make(tag, first), { title });
    for (const part of rest) label.append(make('wbr', ''), part);
    return label;
}

/** A row with the slider of a number. */
function makeNumber(field, id, change) {
    const row = make('div', '', 'row');
    const { slider, show } = makeSlider(field, id, change);
    row.append(Object.assign(makeName('label', field), { htmlFor: id }), slider);
    return { row, show };
}

/** Rows with the sliders of a colour, and a picker if it cannot be brighter than white. */
function makeColour(field, id, change) {
    const row = make('div', '', 'colour');
    row.setAttribute('role', 'group');
    row.setAttribute('aria-label', field.name);
    let shown = [];
    const head = make('div', '', 'row');
    head.append(makeName('span', field));
    const channels = CHANNELS.map((channel, i) => {
        return makeNumber({ ...field, name: channel }, `${id}-${i}`, (value) => change(shown.with(i, value)));
    });
    row.append(head, ...channels.map((channel) => channel.row));
    let showPicker = () => {};
    if (field.most <= 1) {
        const picker = Object.assign(make('input', ''), { type: 'color', title: field.meaning });
        picker.setAttribute('aria-label', `${field.name}, picker`);
        picker.addEventListener('input', () => change(pickedColour(picker.value, shown)));
        picker.addEventListener('change', endDrag);
        head.append(picker);
        showPicker = () => { picker.value = pickerText(shown); };
    }
    const show = (value) => {
        shown = value;
        channels.forEach((channel, i) => channel.show(value[i]));
        showPicker();
    };
    return { row, show };
}

/** A slider with a number beside it. */
function makeSlider(field, id, change) {
    const { name, meaning: title, least, most } = field;
    const slider = make('div', '', 'slider');
    const range = Object.assign(make('input', ''), { type: 'range', max: POSITIONS, id, title });
    const number = Object.assign(make('input', ''), { type: 'number', min: least, max: most, title });
    number.step = 'any';
    number.setAttribute('aria-label', `${name}, number`);
    const scale = scaleOf(field);
    const within = (value) => Math.min(Math.max(value, least), most);
    let shown = NaN;
    range.addEventListener('input', () => {
        change(within(rounded(scale.value(range.valueAsNumber / POSITIONS))));
    });
    number.addEventListener('input', () => {
        if (Number.isFinite(number.valueAsNumber)) change(within(number.valueAsNumber));
    });
    for (const input of [range, number]) {
        input.addEventListener('change', () => {
            endDrag();
            number.value = numberText(shown);
        });
    }
    slider.append(range, number);
    const show = (value) => {
        if (value === shown) return;
        shown = value;
        range.value = POSITIONS * scale.position(value);
        range.setAttribute('aria-valuetext', numberText(value));
        // What is being typed stays as it is.
        const isTyped = document.activeElement === number && within(number.valueAsNumber) === value;
        if (!isTyped) number.value = numberText(value);
    };
    return { slider, show };
}

const numberText = (value) => String(Number(value.toPrecision(6)));

/** A number with three digits: what a pointer sets is not more accurate. */
const rounded = (value) => Number(value.toPrecision(3));

/** How positions from 0 to 1 stand for the values of a field, and values for positions. */
function scaleOf({ least, most }) {
    const isWide = most > MIN_LOGARITHMIC || (least > 0 && most / least > MIN_LOGARITHMIC);
    if (least < 0 || !isWide) {
        return {
            value: (position) => least + (most - least) * position,
            position: (value) => (value - least) / (most - least),
        };
    }
    const low = least || SMALLEST_POSITIVE;
    const ratio = Math.log(most / low);
    return {
        value: (position) => position === 0 ? least : low * Math.exp(ratio * position),
        position: (value) => value <= low ? 0 : Math.log(value / low) / ratio,
    };
}

// ---- colours: the page has linear ones, a picker those of sRGB with 8 bits

const encoded = (x) => x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
const decoded = (y) => y <= 0.04045 ? y / 12.92 : ((y + 0.055) / 1.055) ** 2.4;
const codeOf = (x) => Math.round(255 * encoded(Math.min(Math.max(x, 0), 1)));

function pickerText(rgb) {
    return `#${rgb.map((x) => codeOf(x).toString(16).padStart(2, '0')).join('')}`;
}

/** The colour that was picked. Channels that the picker did not change keep their values. */
function pickedColour(text, rgb) {
    return rgb.map((x, i) => {
        const code = parseInt(text.slice(1 + 2 * i, 3 + 2 * i), 16);
        return code === codeOf(x) ? x : rounded(decoded(code / 255));
    });
}
