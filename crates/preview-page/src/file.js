// A page in a file, which has all that it shows. A page that a server fills has live.js and editor.js instead.

/**
 * What the page shows of a state's subject.
 *
 * Its `views` are those of the material under the environment, which may be none. `parts` loads the entries
 * of mesh and sky, and `view` what each part of the mesh is drawn with in a view.
 */
function sceneOf(state) {
    const place = (field) => CHOICES[field].indexOf(state[field]);
    const [material, environment, mesh] = ['material', 'environment', 'mesh'].map(place);
    const pairOf = (material) => {
        return data.pairs.find((pair) => pair.material === material && pair.environment === environment);
    };
    const chosen = pairOf(material);
    // If the material is one of the mesh's own, each part has its own, as far as the page has it.
    const { parts } = data.meshes[mesh];
    const isOwn = parts.some((part) => part.material === material);
    const pairs = parts.map((part) => (isOwn && pairOf(part.material)) || chosen);
    const drawnWith = (view, i) => {
        const { coordinates, transfer } = parts[i];
        if (isTransfer(view.mode)) return withTransfer(view, transfer);
        const { material, views, base_color } = pairs[i];
        const own = views.find(({ mode }) => mode === view.mode);
        return own && coordinates[material] ? withBaseColor(own, base_color) : own ?? view;
    };
    return {
        number: 0,
        exposure: data.environments[environment].exposure,
        views: (chosen?.views ?? []).filter(({ mode }) => !isTransfer(mode) || parts.every(({ transfer }) => transfer))
            .map((view) => ({ ...view, ...mostOf(parts.map((_, i) => drawnWith(view, i))) })),
        notes: [],
        parts: async () => ({
            mesh: withCoordinates(data.meshes[mesh], pairs.map((pair) => pair?.material)),
            sky: data.skies[environment],
        }),
        view: async (view) => parts.map((_, i) => drawnWith(view, i)),
    };
}

/** What a pixel costs in the most expensive of some parts. */
function mostOf(drawn) {
    const most = (field) => Math.max(...drawn.map((view) => view[field]));
    return { fetches: most('fetches'), lights: most('lights') };
}

/** A view with the texture of a base colour, if its form shows the material. */
function withBaseColor(view, { textures, blocks, fetches }) {
    if (!view.shows_material) return view;
    return {
        ...view,
        fetches: view.fetches + fetches,
        defines: { ...view.defines, TEXTURED: 1 },
        textures: { ...view.textures, ...textures },
        blocks: { ...view.blocks, ...blocks },
    };
}

/** Whether a form is the transfer of meshes, which only some have. */
const isTransfer = (mode) => data.modes[mode].name === 'transfer';

/** A view with the vectors of a part of a mesh. */
function withTransfer(view, { textures, uniforms }) {
    return {
        ...view,
        textures: { ...view.textures, ...textures },
        uniforms: { ...view.uniforms, ...uniforms },
    };
}

// There is no server to ask, and no file of a material to edit.
const chooseSubject = () => [];
const turnBack = () => {};
const serverProblems = () => [];
const isUnsaved = () => false;
const showEditor = () => {};
const connect = () => {};
