import { add, scale, sub, type Vec3 } from '../lib/vec';
import type { SceneRecord } from '../protocol/types';
import { aimed, aimOf, anglesOf, directionOf } from '../state/lamp_make';
import { anchorOf } from '../state/placement';
import { snapAngles, type How } from '../state/snap';
import { useApp } from './context';
import { Handle } from './Handle';

/** Along its aim, metres. */
const REACH_M = 0.6;

/** The end of a lamp's aim: dragged, its light goes there. */
export function AimHandle({ light }: { light: SceneRecord }) {
    const app = useApp();
    const from = anchorOf(light);
    const aim = aimOf(light);
    const turnTo = (point: Vec3, how: How): void => {
        const wanted = sub(point, from);
        const direction = how === 'free' ? wanted : directionOf(snapAngles(anglesOf(wanted), anglesOf(aim), how, app.snap.angleDeg.peek()));
        const op = aimed(light, direction);
        if (op.op === 'set') app.edits.set(op.id, op.path, op.value);
    };
    const end = (): void => {
        app.edits.endGesture();
        const { tilt, turn } = anglesOf(aimOf(app.scene.peek(light.id) ?? light));
        app.toasts.announce(`${light.id} shines ${tilt.toFixed(0)} degrees from straight down, turned by ${turn.toFixed(0)}`);
    };
    return (
        <Handle name={`Aim of ${light.id}`} id={light.id} class="pick-mark aim-mark" at={add(from, scale(aim, REACH_M))} reachable moveTo={turnTo} onEnd={end}>
            <circle r="5" />
        </Handle>
    );
}
