// The start of the page.

/** Why this browser cannot draw, or nothing. */
function start() {
    if (!window.DecompressionStream) return 'This browser has no DecompressionStream to unpack the page.';
    let why = '';
    canvas.addEventListener('webglcontextcreationerror', (event) => { why = event.statusMessage; });
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: true, preserveDrawingBuffer: true });
    if (!gl) return `This browser does not offer WebGL 2${why ? ` (${why})` : ''}.`;

    canvas.addEventListener('webglcontextlost', (event) => {
        event.preventDefault();
        renderer = picture = null;
        requestFrame();
    });
    canvas.addEventListener('webglcontextrestored', () => {
        renderer = new Renderer(gl);
        load();
    });
    renderer = new Renderer(gl);
    element('fallback').hidden = true;
    element('viewer').hidden = false;
    connectControls();
    set(readFragment(location.hash));
    connect();
    followSize();
    return '';
}

const obstacle = start();
if (obstacle) {
    const hasPictures = document.querySelector('#fallback img') !== null;
    const pictures = hasPictures ? ' These pictures show a part of what it would draw.' : '';
    element('reason').textContent = obstacle + pictures;
}
