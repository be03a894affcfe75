import { swatch } from '../lib/colour';
import { add, scale, type Vec3 } from '../lib/vec';
import { vec3Or, type SceneRecord } from '../protocol/types';
import { colourOf, isOn, isPlaced, positionOf } from '../state/lights';
import { project } from '../view/camera';
import { useApp } from './context';
import { LampMarker } from './LampMarker';

/** With more lamps than this only the selected one is marked: the picture is what counts. */
const MAX_MARKERS = 48;

/** Lamps and the picked point, drawn over the picture with the camera of the frame that is on screen. */
export function Overlay() {
    const app = useApp();
    const [width, height] = app.view.cssSize.value;
    const ids = app.scene.list('light').value;
    const selected = app.selectedLight.value;
    const shown = app.markers.value && ids.length <= MAX_MARKERS ? ids : ids.filter((id) => id === selected);
    // The selected one last: on top.
    const ordered = [...shown].sort((a, b) => Number(a === selected) - Number(b === selected));
    return (
        <svg class="overlay" viewBox={`0 0 ${width} ${height}`} aria-label="Lamp markers">
            <PickMark />
            {ordered.map((id) => (
                <Lamp key={id} id={id} />
            ))}
        </svg>
    );
}

function Lamp({ id }: { id: string }) {
    const app = useApp();
    const light = app.scene.record(id);
    if (!light || !isPlaced(light)) return null;
    const selected = app.selectedLight.value === id;
    const [width, height] = app.view.cssSize.value;
    const at = project(app.view.shownPose.value, app.view.aspect.value, positionOf(light));
    if (!at || at.x < 0 || at.x > 1 || at.y < 0 || at.y > 1) return null;
    return (
        <>
            {selected && <Shape light={light} />}
            <LampMarker
                id={id}
                x={at.x * width}
                y={at.y * height}
                colour={swatch(colourOf(light).linear)}
                on={isOn(light)}
                selected={selected}
            />
        </>
    );
}

/** The outline of a quad, the aim of a spot. */
function Shape({ light }: { light: SceneRecord }) {
    const app = useApp();
    const [width, height] = app.view.cssSize.value;
    const points = outline(light).map((p) => project(app.view.shownPose.value, app.view.aspect.value, p));
    if (points.length < 2 || points.some((p) => p === null)) return null;
    const path = points.map((p) => `${p!.x * width},${p!.y * height}`).join(' ');
    return <polyline class="lamp-shape" points={path} />;
}

function outline(light: SceneRecord): Vec3[] {
    const centre = positionOf(light);
    if (light.kind === 'quad') {
        const u = vec3Or(light.u, [1, 0, 0]);
        const v = vec3Or(light.v, [0, 0, 1]);
        const corner = (a: number, b: number): Vec3 => add(centre, add(scale(u, a / 2), scale(v, b / 2)));
        return [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1), corner(-1, -1)];
    }
    const direction = vec3Or(light.direction, [0, 0, 0]);
    const aimed = light.kind === 'spot' || light.kind === 'disc';
    return aimed ? [centre, add(centre, scale(direction, 0.6 / Math.max(1e-9, Math.hypot(...direction))))] : [];
}

function PickMark() {
    const app = useApp();
    const reading = app.reading.value;
    if (!reading) return null;
    const [width, height] = app.view.cssSize.value;
    const at = project(app.view.shownPose.value, app.view.aspect.value, reading.pick.point);
    if (!at) return null;
    return (
        <g class="pick-mark" transform={`translate(${at.x * width} ${at.y * height})`}>
            <circle r="5" />
            <path d="M-11 0h5M6 0h5M0-11v5M0 6v5" />
        </g>
    );
}
