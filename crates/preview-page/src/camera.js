// The camera, which agrees with the renderer of the sheets, and the pointers that move it.

/** The field of view across the shorter side of the picture. */
const FIELD = Math.PI / 6;

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1],
    a[2] * b[0] - a[0] * b[2],
    a[0] * b[1] - a[1] * b[0],
];

/** What the block `page` says about camera and light; matrices are by columns. */
function cameraUniforms({ yaw, pitch, zoom, turn, tilt }, { centre, radius }, width, height) {
    const forward = [-Math.cos(pitch) * Math.cos(yaw), -Math.cos(pitch) * Math.sin(yaw), -Math.sin(pitch)];
    const right = [-Math.sin(yaw), Math.cos(yaw), 0];
    const up = cross(right, forward);
    const distance = radius / Math.sin(FIELD / 2);
    const eye = centre.map((value, axis) => value - forward[axis] * distance);
    const scale = Math.tan(FIELD / 2) / zoom / Math.min(width, height);
    const half = [width * scale, height * scale];
    const near = Math.max(distance - radius, 1e-3 * radius) / 2;
    const far = distance + 4 * radius;

    // A row is a vector and a number: its value at q is the vector's product with q - eye, plus the number.
    const slope = (far + near) / (far - near);
    const rows = [
        [right.map((value) => value / half[0]), 0],
        [up.map((value) => value / half[1]), 0],
        [forward.map((value) => value * slope), -2 * far * near / (far - near)],
        [forward, 0],
    ];
    const clip = [0, 1, 2].flatMap((axis) => rows.map(([vector]) => vector[axis]));
    clip.push(...rows.map(([vector, number]) => number - dot(vector, eye)));

    return {
        'page.clip': clip,
        'page.to_light': intoLight(turn, tilt),
        'page.eye': eye,
        'page.ray_right': right.map((value) => value * half[0]),
        'page.ray_up': up.map((value) => value * half[1]),
        'page.ray_forward': forward,
    };
}

/** The inverse of R_z(turn) R_y(tilt), whose columns are the rows of that rotation. */
function intoLight(turn, tilt) {
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const [d, t] = [Math.cos(tilt), Math.sin(tilt)];
    return [c * d, -s, c * t, s * d, c, s * t, -t, 0, d];
}

/**
 * Turns pointers and wheel into movements: `orbit` and `turn` of a distance in shares of the canvas' shorter
 * side, `zoom` by a factor, and `reset`.
 */
function followPointers(canvas, { orbit, turn, zoom, reset }) {
    const held = new Map();
    let fingers = null; // where two fingers began, where they were last, and what they do
    const side = () => Math.min(canvas.clientWidth, canvas.clientHeight) || 1;

    const change = () => {
        const span = held.size === 2 ? spanOf(held) : null;
        fingers = span && { start: span, last: span, action: '', isDue: false };
    };
    // Each finger has events of its own, so that only those of a whole frame show what both do.
    const moveFingers = (pair) => {
        pair.isDue = false;
        if (pair !== fingers) return;
        const { start, last } = pair;
        const now = pair.last = spanOf(held);
        pair.action ||= actionOf(start, now);
        if (pair.action === 'zoom') zoom(now.length / last.length);
        if (pair.action === 'turn') {
            const angle = Math.sin(now.angle - last.angle);
            turn((now.x - last.x) / side() - angle / Math.PI, (now.y - last.y) / side());
        }
    };

    canvas.addEventListener('pointerdown', (event) => {
        canvas.setPointerCapture(event.pointerId);
        held.set(event.pointerId, [event.clientX, event.clientY]);
        change();
    });
    canvas.addEventListener('pointermove', (event) => {
        const last = held.get(event.pointerId);
        if (!last) return;
        held.set(event.pointerId, [event.clientX, event.clientY]);
        if (held.size === 1) {
            const isTurn = event.shiftKey || (event.buttons & 2) !== 0;
            (isTurn ? turn : orbit)((event.clientX - last[0]) / side(), (event.clientY - last[1]) / side());
        } else if (fingers && !fingers.isDue) {
            fingers.isDue = true;
            requestAnimationFrame(moveFingers.bind(null, fingers));
        }
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) {
        canvas.addEventListener(end, (event) => {
            if (held.delete(event.pointerId)) change();
        });
    }
    canvas.addEventListener('wheel', (event) => {
        event.preventDefault();
        const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1);
        zoom(Math.exp(-pixels * (event.ctrlKey ? 0.01 : 0.0015)));
    }, { passive: false });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('dblclick', reset);
}

/** The middle, length and angle of the line between two pointers. */
function spanOf(held) {
    const [a, b] = held.values();
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const [x, y] = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    return { x, y, length: Math.hypot(dx, dy) || 1, angle: Math.atan2(dy, dx) };
}

/** What two fingers do: nothing until one of their movements has 10 pixels, so that a pinch does not turn. */
function actionOf(start, now) {
    const pinch = Math.abs(now.length - start.length);
    const drag = Math.hypot(now.x - start.x, now.y - start.y);
    const rotation = Math.abs(Math.sin(now.angle - start.angle)) * start.length / 2;
    if (Math.max(pinch, drag, rotation) < 10) return '';
    return pinch > Math.max(drag, rotation) ? 'zoom' : 'turn';
}
