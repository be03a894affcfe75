import type { ComponentChildren } from 'preact';
import { useRef } from 'preact/hooks';
import type { Vec3 } from '../lib/vec';
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
    /** Enter and Space. */
    onPress?(): void;
    /** One step of a gesture, which the handle ends. */
    moveTo(point: Vec3): void;
    children: ComponentChildren;
}

const NUDGE = 0.01;
const ARROWS: Record<string, [number, number]> = {
    ArrowLeft: [-NUDGE, 0],
    ArrowRight: [NUDGE, 0],
    ArrowUp: [0, -NUDGE],
    ArrowDown: [0, NUDGE],
};

const isOutside = ({ x, y }: { x: number; y: number }): boolean => x < 0 || x > 1 || y < 0 || y > 1;

/** A point of the scene in the picture that is taken and moved: parallel to the picture, with Shift over the floor. */
export function Handle({ name, id, at, reachable, onGrab, onPress, moveTo, children, ...props }: Props) {
    const app = useApp();
    /** Where on the handle it was taken, so that it does not jump under the pointer. */
    const grip = useRef<{ dx: number; dy: number } | null>(null);
    const moved = useRef(false);
    const [width, height] = app.view.cssSize.value;
    const pose = app.view.shownPose.value;
    const aspect = app.view.aspect.value;
    const place = project(pose, aspect, at);
    if (!place || (!grip.current && isOutside(place))) return null;
    const x = place.x * width;
    const y = place.y * height;

    const movePlace = (toX: number, toY: number, overFloor: boolean): void => {
        const point = (overFloor ? dragOverFloor : dragInPicturePlane)(pose, aspect, at, toX, toY);
        if (!point) return;
        moved.current = true;
        moveTo(point);
    };
    const end = (): void => {
        if (moved.current) app.endMove(id);
        else app.edits.endGesture();
        moved.current = false;
    };
    const down = (e: PointerEvent): void => {
        if (e.button !== 0) return;
        e.stopPropagation(); // the camera stays
        onGrab?.();
        if (!app.mayEdit.value) return;
        (e.currentTarget as Element).setPointerCapture(e.pointerId);
        grip.current = { dx: x - e.clientX, dy: y - e.clientY };
    };
    const move = (e: PointerEvent): void => {
        if (!grip.current) return;
        movePlace((e.clientX + grip.current.dx) / width, (e.clientY + grip.current.dy) / height, e.shiftKey);
    };
    const up = (): void => {
        grip.current = null;
        end();
    };
    const key = (e: KeyboardEvent): void => {
        if (e.key === 'Enter' || e.key === ' ') {
            e.preventDefault();
            e.stopPropagation();
            onPress?.();
            return;
        }
        const step = ARROWS[e.key];
        if (!step) return;
        e.preventDefault();
        e.stopPropagation();
        onGrab?.();
        movePlace(place.x + step[0], place.y + step[1], e.shiftKey);
        end();
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
        >
            <circle class="handle-hit" r="16" />
            {children}
        </g>
    );
}
