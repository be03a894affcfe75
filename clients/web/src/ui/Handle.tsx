import type { ComponentChildren } from 'preact';
import { useRef } from 'preact/hooks';
import { sub, type Vec3 } from '../lib/vec';
import type { Modifiers } from '../state/selection';
import type { How } from '../state/snap';
import { dragInPicturePlane, dragOverFloor, project } from '../view/camera';
import { useApp } from './context';

interface Props {
    /** What it moves. */
    name: string;
    /** The record that it moves. */
    id: string;
    class: string;
    /** In the scene. */
    at: Vec3;
    /** By the Tab key. */
    reachable: boolean;
    onGrab?(): void;
    /** Enter and Space; a click with Ctrl or Shift. */
    onPress?(keys: Modifiers): void;
    /** One step of a gesture, which the handle ends; absent: it moves the record as far as itself. */
    moveTo?(point: Vec3, how: How): void;
    onEnd?(): void;
    children: ComponentChildren;
}

/** Hands tremble: fewer pixels are a click. */
const SLOP_PX = 3;
const NUDGE = 0.01;
const ARROWS: Record<string, [number, number]> = {
    ArrowLeft: [-NUDGE, 0],
    ArrowRight: [NUDGE, 0],
    ArrowUp: [0, -NUDGE],
    ArrowDown: [0, NUDGE],
};

const isModified = (e: Modifiers): boolean => e.ctrlKey || e.metaKey || e.shiftKey;
const isOutside = ({ x, y }: { x: number; y: number }): boolean => x < 0 || x > 1 || y < 0 || y > 1;

/** A point of the scene in the picture that is taken and moved: parallel to the picture, with Shift over the floor, with Ctrl by steps. */
export function Handle({ name, id, at, reachable, onGrab, onPress, moveTo, onEnd, children, ...props }: Props) {
    const app = useApp();
    /** Where on the handle it was taken, so that it does not jump under the pointer, and where it was then. */
    const grip = useRef<{ dx: number; dy: number; from: Vec3 } | null>(null);
    const moved = useRef(false);
    const [width, height] = app.view.cssSize.value;
    const pose = app.view.shownPose.value;
    const aspect = app.view.aspect.value;
    const place = project(pose, aspect, at);
    if (!place || (!grip.current && isOutside(place))) return null;
    const x = place.x * width;
    const y = place.y * height;

    const grab = (): void => {
        onGrab?.();
        app.mover.grab(id);
    };
    const movePlace = (from: Vec3, toX: number, toY: number, overFloor: boolean, how: How): void => {
        const point = (overFloor ? dragOverFloor : dragInPicturePlane)(pose, aspect, from, toX, toY);
        if (!point) return;
        moved.current = true;
        if (moveTo) moveTo(point, how);
        else app.mover.by(sub(point, from), how);
    };
    const end = (): void => {
        if (!moved.current) app.edits.endGesture();
        else if (onEnd) onEnd();
        else app.mover.end();
        moved.current = false;
    };
    const down = (e: PointerEvent): void => {
        if (e.button !== 0) return;
        e.stopPropagation(); // the camera stays
        if (!isModified(e)) grab();
        (e.currentTarget as Element).setPointerCapture(e.pointerId);
        grip.current = { dx: x - e.clientX, dy: y - e.clientY, from: at };
    };
    const move = (e: PointerEvent): void => {
        const taken = grip.current;
        if (!taken) return;
        const [toX, toY] = [e.clientX + taken.dx, e.clientY + taken.dy];
        if (!moved.current && Math.hypot(toX - x, toY - y) < SLOP_PX) return;
        if (!app.mayEdit.value) {
            grip.current = null; // no click, and it stays
            return;
        }
        if (!moved.current && isModified(e)) grab();
        movePlace(taken.from, toX / width, toY / height, e.shiftKey, app.snap.how(e, false));
    };
    const up = (e: PointerEvent): void => {
        const clicked = grip.current !== null && !moved.current && e.type === 'pointerup';
        grip.current = null;
        end();
        if (clicked && isModified(e)) onPress?.(e);
    };
    const key = (e: KeyboardEvent): void => {
        if (e.key === 'Enter' || e.key === ' ') {
            e.preventDefault();
            e.stopPropagation();
            onPress?.(e);
            return;
        }
        const step = ARROWS[e.key];
        if (!step) return;
        e.preventDefault();
        e.stopPropagation();
        grab();
        movePlace(at, place.x + step[0], place.y + step[1], e.shiftKey, app.snap.how(e, true));
    };
    /** A key that is held is one gesture: it ends when it is let go, or the focus leaves. */
    const keyed = (): void => {
        if (moved.current && !grip.current) end();
    };
    return (
        <g
            {...props}
            transform={`translate(${x} ${y})`}
            tabindex={reachable ? 0 : -1}
            role="button"
            aria-label={app.mayEdit.value ? `${name}: drag or use the arrow keys to move it` : name}
            onPointerDown={down}
            onPointerMove={move}
            onPointerUp={up}
            onPointerCancel={up}
            onKeyDown={key}
            onKeyUp={keyed}
            onBlur={keyed}
        >
            <circle class="handle-hit" r="16" />
            {children}
        </g>
    );
}
