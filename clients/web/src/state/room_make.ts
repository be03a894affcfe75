/** An empty room as ops: six surfaces of known reflectance, and a camera that stands in it. Pure. */
import { newId } from '../lib/ids';
import { add, length, scale, sub, type Vec3 } from '../lib/vec';
import type { Json } from '../protocol/rpc';
import type { CameraPose, Op } from '../protocol/types';

export interface Room {
    /** Metres: along X, along Z, up. */
    length: number;
    width: number;
    height: number;
    /** Percent of the light. */
    ceiling: number;
    walls: number;
    floor: number;
}

/** The reflectances that tables of luminaires stand for; the size is that of an office for six. */
export const USUAL_ROOM: Room = { length: 9, width: 6, height: 2.8, ceiling: 70, walls: 50, floor: 20 };

/** The limits of the form: a corridor's width to a hall. Light that nothing absorbs never ends. */
export const ROOM_LIMITS = { side: { min: 1, max: 200 }, height: { min: 1, max: 50 }, reflectance: { min: 0, max: 95 } };

const EYE_M = 1.6;

export interface RoomOps {
    ops: Op[];
    pose: CameraPose;
}

/** The middle of its floor is the origin. What is there already keeps its ids, and its camera. */
export function roomOps(room: Room, taken: (id: string) => boolean): RoomOps {
    const name = newId('room', (id) => [id, `${id}-view`, ...surfaces(room, id).map((op) => op.id)].some(taken));
    const pose = standing(room);
    const camera = taken('main') ? `${name}-view` : 'main';
    const look: Op = { op: 'add', type: 'camera', id: camera, position: [...pose.position], target: [...pose.target], up: [...pose.up], vfov_deg: pose.vfov_deg };
    return { ops: [...surfaces(room, name), look], pose };
}

function surfaces(room: Room, name: string): Op[] {
    const { length: l, width: w, height: h } = room;
    const ops: Op[] = [];
    const paint = (what: 'ceiling' | 'walls' | 'floor'): string => {
        const id = `${name}-${what}-paint`;
        const share = room[what] / 100;
        ops.push({ op: 'add', type: 'material', id, base_color: [share, share, share], specular: 0, roughness: 1 });
        return id;
    };
    const face = (what: string, size: [number, number], material: string, translate: Json, rotate: Json): void => {
        const mesh = `${name}-${what}-mesh`;
        ops.push({ op: 'add', type: 'mesh', id: mesh, shape: 'quad', size: [size[0], 0, size[1]] });
        ops.push({ op: 'add', type: 'object', id: `${name}-${what}`, mesh, material, transform: { translate, rotate_deg: rotate } });
    };
    face('floor', [l, w], paint('floor'), [0, 0, 0], [0, 0, 0]);
    face('ceiling', [l, w], paint('ceiling'), [0, h, 0], [180, 0, 0]);
    const walls = paint('walls');
    face('back', [l, h], walls, [0, h / 2, -w / 2], [90, 0, 0]);
    face('front', [l, h], walls, [0, h / 2, w / 2], [-90, 0, 0]);
    face('left', [h, w], walls, [-l / 2, h / 2, 0], [0, 0, -90]);
    face('right', [h, w], walls, [l / 2, h / 2, 0], [0, 0, 90]);
    return ops;
}

/** In the corner at the left of the front, looking across. Who turns about a target so near stays inside. */
function standing({ length: l, width: w, height: h }: Room): CameraPose {
    const gap = 0.1 * Math.min(l, w);
    const eye: Vec3 = [gap - l / 2, Math.min(EYE_M, 0.8 * h), w / 2 - gap];
    const over = sub([0.15 * l, 0.45 * h, -0.15 * w], eye);
    return { position: eye, target: add(eye, scale(over, (0.5 * gap) / length(over))), up: [0, 1, 0], vfov_deg: 65 };
}
