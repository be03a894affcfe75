import type { ComponentChildren } from 'preact';
import { swatch } from '../lib/colour';
import { fixed, number } from '../lib/format';
import { withRoom } from '../lib/labels';
import { add, scale, type Vec3 } from '../lib/vec';
import { vec3Or, type SceneRecord } from '../protocol/types';
import { centreOf, colourOf, isLamp, isOn, isPlaced, nameOf } from '../state/lights';
import { isAimed } from '../state/lamp_make';
import { markedOf } from '../state/lamps';
import { anchorOf } from '../state/placement';
import { apart, judge, pointAt, type SensorReading } from '../state/sensors';
import type { App } from '../state/app';
import { isOfLight } from '../state/view';
import { project } from '../view/camera';
import { AimHandle } from './AimHandle';
import { useApp } from './context';
import { Handle } from './Handle';
import { Lazy } from './Lazy';

const peopleMarks = () => import('./PeopleMarks').then((m) => m.PeopleMarks);

/** Of more lamps than this in the picture only the nearest are marked: the picture is what counts. */
const MAX_MARKERS = 48;

/** Lamps and the picked point, drawn over the picture with the camera of the frame that is on screen. */
export function Overlay() {
    const app = useApp();
    const [width, height] = app.view.cssSize.value;
    const ids = app.scene.lamps.value;
    const selected = app.selection.ids.value;
    const pose = app.view.shownPose.value;
    const depth = (id: string): number | null => {
        const light = app.scene.record(id);
        const at = light && isPlaced(light) ? project(pose, app.view.aspect.value, centreOf(light)) : null;
        return at && at.x >= 0 && at.x <= 1 && at.y >= 0 && at.y <= 1 ? at.depth : null;
    };
    // Where all may be marked nothing is looked up: a handle under the hand may leave the picture.
    const few = ids.length <= MAX_MARKERS;
    const shown = markedOf(ids, selected, app.markers.value ? MAX_MARKERS : 0, few ? () => 0 : depth);
    const objects = selected.filter((id) => !isLamp(app.scene.record(id)));
    const named = namedOf(app, selected);
    return (
        <svg class="overlay" viewBox={`0 0 ${width} ${height}`} aria-label="Markers">
            <AtNowsSide>
                <Isolines />
                <SensorPoints />
            </AtNowsSide>
            <Lazy when={app.people.others.value.length > 0} load={peopleMarks} with={{}} />
            <PickMark />
            {objects.map((id) => (
                <SelectedObject key={id} id={id} named={named.has(id)} />
            ))}
            {shown.map((id) => (
                <Lamp key={id} id={id} named={named.has(id)} />
            ))}
        </svg>
    );
}

/** Of many that are selected not all names have room: the newest goes first. */
function namedOf(app: App, selected: readonly string[]): Set<string> {
    const [width, height] = app.view.cssSize.value;
    const newest = [...selected].reverse();
    const labels = newest.map((id) => {
        const record = app.scene.record(id);
        if (!record || (isLamp(record) && !isPlaced(record))) return null;
        const at = project(app.view.shownPose.value, app.view.aspect.value, isLamp(record) ? centreOf(record) : anchorOf(record));
        return at && { x: at.x * width, y: at.y * height, text: nameOf(record) };
    });
    return new Set([...withRoom(labels)].map((i) => newest[i]!));
}

/** Numbers of the light there is now are not laid over a picture of another. */
function AtNowsSide({ children }: { children: ComponentChildren }) {
    const { compare, view } = useApp();
    const [width, height] = view.cssSize.value;
    const sides = compare.sides.value;
    const at = width * compare.at.value;
    const [from, to] = !sides ? [0, width] : sides[0] === 'now' ? [0, at] : sides[1] === 'now' ? [at, width] : [0, 0];
    return (
        <>
            <clipPath id="nows-side">
                <rect x={from} y="0" width={to - from} height={height} />
            </clipPath>
            <g clip-path={sides ? 'url(#nows-side)' : undefined}>{children}</g>
        </>
    );
}

/** The values of lines of equal light; the lines are in the picture. */
function Isolines() {
    const app = useApp();
    const frame = app.meter.frame.value;
    const legend = app.meter.server.value?.legend;
    const [width, height] = app.view.cssSize.value;
    if (!frame || !legend || !isOfLight(app.view.settings.value.overlay)) return null;
    return (
        <g class="isolines" aria-hidden="true">
            {legend.labels.map(({ x, y, value }) => (
                <text key={`${x} ${y}`} x={(x / frame.width) * width} y={(y / frame.height) * height} text-anchor="middle" dominant-baseline="central">
                    {number(value)}
                </text>
            ))}
        </g>
    );
}

/** Numbers that are closer than this, in pixels, are left out: the dots stay. */
const NUMBER_ROOM = 34;
/** Of more the picture would be a table. */
const MOST_POINTS = 1500;

interface Points {
    record: SceneRecord;
    reading: SensorReading;
    places: readonly ({ x: number; y: number } | null)[];
}

/** The points of light meters, by what is wanted of them. What they say is in the panel, too. Where sensors lie over each other in the picture
 *  the numbers of all of them are thinned together. */
function SensorPoints() {
    const app = useApp();
    if (!app.sensors.pointsShown.value) return null;
    const all = app.scene.list('sensor').value.flatMap((id) => pointsOf(app, id) ?? []);
    const roomy = apart(all.flatMap((p) => p.places), NUMBER_ROOM, NUMBER_ROOM / 2);
    let first = 0;
    return (
        <g class="sensor-points" aria-hidden="true">
            {all.map((p) => {
                const from = first;
                first += p.places.length;
                return <PointsOf key={p.record.id} points={p} hasRoom={(i) => roomy.has(from + i)} />;
            })}
        </g>
    );
}

function pointsOf(app: App, id: string): Points | null {
    const record = app.scene.record(id);
    const reading = app.sensors.readings.value.get(id);
    if (!record || !reading || reading.values.length === 0 || reading.values.length > MOST_POINTS) return null;
    const [width, height] = app.view.cssSize.value;
    const places = reading.values.map((value, i) => {
        const at = value === null ? null : project(app.view.shownPose.value, app.view.aspect.value, pointAt(record, reading, i));
        return at && { x: at.x * width, y: at.y * height };
    });
    return { record, reading, places };
}

function PointsOf({ points: { record, reading, places }, hasRoom }: { points: Points; hasRoom(i: number): boolean }) {
    const app = useApp();
    const current = app.online.value && reading.rev >= app.scene.rev.value;
    return (
        <g class={current ? '' : 'is-old'}>
            {reading.values.map((value, i) => {
                const at = places[i];
                if (value === null || !at) return null;
                const verdict = judge(value, record);
                return (
                    <g key={i} class={`point is-${verdict}`} transform={`translate(${at.x.toFixed(1)} ${at.y.toFixed(1)})`}>
                        {verdict === 'missed' ? <path d="M-4-4L4 4M-4 4L4-4" /> : <circle r="4" />}
                        {hasRoom(i) && (
                            <text y="14" text-anchor="middle">
                                {reading.quantity === 'ugr' ? fixed(value, 1) : number(value < 10 ? Number(value.toPrecision(2)) : Math.round(value))}
                            </text>
                        )}
                    </g>
                );
            })}
        </g>
    );
}

function Lamp({ id, named }: { id: string; named: boolean }) {
    const app = useApp();
    const light = app.scene.record(id);
    if (!light || !isPlaced(light)) return null;
    const ids = app.selection.ids.value;
    const selected = app.selection.chosen.value.has(id);
    const on = isOn(light);
    return (
        <>
            {selected && <Shape light={light} />}
            {selected && ids.length === 1 && isAimed(light) && app.mayEdit.value && <AimHandle light={light} />}
            <Handle
                name={`Lamp ${id}`}
                id={id}
                onPress={(keys) => app.selection.click(id, keys)}
                class={`lamp ${selected ? 'is-selected' : ''} ${named ? 'is-named' : ''} ${on ? '' : 'is-off'}`}
                at={centreOf(light)}
                reachable={id === ids[ids.length - 1]}
                onGrab={() => {
                    if (!app.selection.many.value.includes(id)) app.lamps.selected.value = id;
                }}
            >
                {selected && <circle class="handle-ring" r="12" />}
                <circle class="lamp-core" r={selected ? 6 : 5} fill={on ? swatch(colourOf(light).linear) : 'none'} />
                <text class="lamp-name" y="-18" text-anchor="middle">
                    {nameOf(light)}
                </text>
            </Handle>
        </>
    );
}

/** Of an object or a model that is one of several: where its anchor is. */
function SelectedObject({ id, named }: { id: string; named: boolean }) {
    const app = useApp();
    const record = app.scene.record(id);
    if (!record) return null;
    return (
        <Handle name={id} id={id} onPress={(keys) => app.selection.click(id, keys)} class={`lamp is-selected is-object ${named ? 'is-named' : ''}`} at={anchorOf(record)} reachable>
            <rect class="handle-ring" x="-9" y="-9" width="18" height="18" />
            <circle class="lamp-core" r="4" />
            <text class="lamp-name" y="-18" text-anchor="middle">
                {nameOf(record)}
            </text>
        </Handle>
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
    const centre = anchorOf(light);
    if (light.kind === 'quad') {
        const u = vec3Or(light.u, [1, 0, 0]);
        const v = vec3Or(light.v, [0, 0, 1]);
        const corner = (a: number, b: number): Vec3 => add(centre, add(scale(u, a / 2), scale(v, b / 2)));
        return [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1), corner(-1, -1)];
    }
    const direction = vec3Or(light.direction, [0, 0, 0]);
    const aimed = light.kind === 'spot' || light.kind === 'ies' || light.kind === 'disc';
    return aimed ? [centre, add(centre, scale(direction, 0.6 / Math.max(1e-9, Math.hypot(...direction))))] : [];
}

/** The picked point; what it lies on is moved by it. */
function PickMark() {
    const app = useApp();
    const reading = app.lux.reading.value;
    if (!reading) return null;
    const at = app.lux.point(reading);
    const { carrier } = reading;
    if (carrier) {
        return (
            <Handle
                name={carrier.id}
                id={carrier.id}
                onPress={() => app.frameSelection()}
                class="pick-mark"
                at={at}
                reachable
            >
                <circle class="handle-ring" r="12" />
                <circle r="3" />
                <path d="M-19 0h5M14 0h5M0-19v5M0 14v5" />
            </Handle>
        );
    }
    const [width, height] = app.view.cssSize.value;
    const place = project(app.view.shownPose.value, app.view.aspect.value, at);
    if (!place) return null;
    return (
        <g class="pick-mark" transform={`translate(${place.x * width} ${place.y * height})`}>
            <circle r="5" />
            <path d="M-11 0h5M6 0h5M0-11v5M0 6v5" />
        </g>
    );
}
