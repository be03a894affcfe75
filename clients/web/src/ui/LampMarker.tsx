import { useRef } from 'preact/hooks';
import type { Vec3 } from '../lib/vec';
import { positionOf } from '../state/lights';
import { dragInPicturePlane, dragOverFloor, project } from '../view/camera';
import type { App } from '../state/app';
import { useApp } from './context';

interface Props {
    id: string;
    x: number;
    y: number;
    colour: string;
    on: boolean;
    selected: boolean;
}

const NUDGE = 0.01;
const ARROWS: Record<string, [number, number]> = {
    ArrowLeft: [-NUDGE, 0],
    ArrowRight: [NUDGE, 0],
    ArrowUp: [0, -NUDGE],
    ArrowDown: [0, NUDGE],
};

/** Moves the lamp to a place in the picture: parallel to it, or over the floor. */
function moveLamp(app: App, id: string, x: number, y: number, overFloor: boolean): void {
    const light = app.scene.peek(id);
    if (!light) return;
    const move = overFloor ? dragOverFloor : dragInPicturePlane;
    const p = move(app.view.shownPose.value, app.view.aspect.value, positionOf(light), x, y);
    if (p) app.edits.set(id, '/position', p.map(millimetres));
}

const millimetres = (v: number): number => Math.round(v * 1000) / 1000;

function placeOf(app: App, position: Vec3): { x: number; y: number } | null {
    return project(app.view.shownPose.value, app.view.aspect.value, position);
}

/** A lamp in the picture: click selects it, dragging moves it, and so do the arrow keys. */
export function LampMarker({ id, x, y, colour, on, selected }: Props) {
    const app = useApp();
    /** Where on the marker it was taken, so that it does not jump under the pointer. */
    const grip = useRef<{ dx: number; dy: number } | null>(null);
    const [width, height] = app.view.cssSize.value;

    const down = (e: PointerEvent): void => {
        if (e.button !== 0) return;
        (e.currentTarget as Element).setPointerCapture(e.pointerId);
        grip.current = { dx: x - e.clientX, dy: y - e.clientY };
        app.selectedLight.value = id;
    };
    const move = (e: PointerEvent): void => {
        if (!grip.current) return;
        moveLamp(app, id, (e.clientX + grip.current.dx) / width, (e.clientY + grip.current.dy) / height, e.shiftKey);
    };
    const up = (): void => {
        grip.current = null;
        app.edits.endGesture();
    };
    const key = (e: KeyboardEvent): void => {
        const step = ARROWS[e.key];
        const light = app.scene.peek(id);
        const at = light && placeOf(app, positionOf(light));
        if (!step || !at) return;
        e.preventDefault();
        e.stopPropagation();
        moveLamp(app, id, at.x + step[0], at.y + step[1], e.shiftKey);
        app.edits.endGesture();
    };
    return (
        <g
            class={`lamp ${selected ? 'is-selected' : ''} ${on ? '' : 'is-off'}`}
            transform={`translate(${x} ${y})`}
            tabIndex={selected ? 0 : -1}
            role="button"
            aria-label={`Lamp ${id}: drag or use the arrow keys to move it`}
            onPointerDown={down}
            onPointerMove={move}
            onPointerUp={up}
            onPointerCancel={up}
            onKeyDown={key}
        >
            <circle class="lamp-hit" r="16" />
            {selected && <circle class="lamp-ring" r="12" />}
            <circle class="lamp-core" r={selected ? 6 : 5} fill={on ? colour : 'none'} />
            <text class="lamp-name" y="-18" text-anchor="middle">
                {id}
            </text>
        </g>
    );
}
