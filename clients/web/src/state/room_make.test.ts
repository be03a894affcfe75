import assert from 'node:assert/strict';
import { test } from 'node:test';
import { RpcError, type Json, type JsonObject } from '../protocol/rpc';
import { stringOr } from '../protocol/types';
import { Edits } from './edits';
import { Imports } from './imports';
import { roomOps, USUAL_ROOM } from './room_make';
import { SceneMirror } from './scene';
import { Toasts } from './toasts';

const numbers = (v: Json | undefined): number[] => (v as number[]).map(Number);

/** About X, then Y, then Z; degrees. */
function turned([x, y, z]: number[], degrees: number[]): number[] {
    const [a, b, c] = degrees.map((d) => (d * Math.PI) / 180) as [number, number, number];
    [y, z] = [y! * Math.cos(a) - z! * Math.sin(a), y! * Math.sin(a) + z! * Math.cos(a)];
    [z, x] = [z * Math.cos(b) - x! * Math.sin(b), z * Math.sin(b) + x! * Math.cos(b)];
    [x, y] = [x * Math.cos(c) - y * Math.sin(c), x * Math.sin(c) + y * Math.cos(c)];
    return [x, y, z];
}

test('six faces look into the room, close it, and have the reflectances', () => {
    const room = { ...USUAL_ROOM, length: 7, width: 3, height: 2.5 };
    const ops = roomOps(room, () => false).ops as (JsonObject & { id: string })[];
    const find = (id: string) => ops.find((op) => op.id === id)!;
    const objects = ops.filter((op) => op.type === 'object');
    const corners = new Map<string, number>();
    for (const object of objects) {
        const { translate, rotate_deg: rotate } = object.transform as { translate: Json; rotate_deg: Json };
        const at = numbers(translate);
        const [nx, ny, nz] = turned([0, 1, 0], numbers(rotate));
        assert.ok(nx! * -at[0]! + ny! * (1.25 - at[1]!) + nz! * -at[2]! > 1, `${object.id} looks inward`);
        const [sx, , sz] = numbers(find(stringOr(object.mesh, '')).size);
        for (const u of [-0.5, 0.5])
            for (const v of [-0.5, 0.5]) {
                const corner = turned([u * sx!, 0, v * sz!], numbers(rotate)).map((c, k) => Math.round(1e6 * (c + at[k]!)) / 1e6 + 0);
                corners.set(String(corner), (corners.get(String(corner)) ?? 0) + 1);
            }
        const share = { floor: 0.2, ceiling: 0.7 }[object.id.replace('room-', '')] ?? 0.5;
        assert.deepEqual(find(stringOr(object.material, '')).base_color, [share, share, share]);
    }
    assert.equal(objects.length, 6);
    assert.deepEqual([...corners.keys()].sort(), [-3.5, 3.5].flatMap((x) => [0, 2.5].flatMap((y) => [-1.5, 1.5].map((z) => String([x, y, z])))).sort());
    assert.ok([...corners.values()].every((n) => n === 3), 'three faces meet in each corner');
});

test('the camera stands in the room, be it a corridor or low, and a second room and its camera get ids of their own', () => {
    for (const [length, width, height] of [[1, 1, 1], [30, 1.5, 2.4], [200, 200, 50]] as const) {
        const { pose } = roomOps({ ...USUAL_ROOM, length, width, height }, () => false);
        for (const [x, y, z] of [pose.position, pose.target]) assert.ok(Math.abs(x) < length / 2 && y > 0 && y < height && Math.abs(z) < width / 2, `${[x, y, z]}`);
    }
    const first = new Set(roomOps(USUAL_ROOM, () => false).ops.map((op) => op.id));
    const second = roomOps(USUAL_ROOM, (id) => first.has(id)).ops.map((op) => op.id);
    assert.ok(first.has('main') && second.includes('room-2-view') && second.every((id) => !first.has(id)));
    const left = [...first].filter((id) => id.endsWith('-paint') || id.endsWith('-mesh')); // whose objects were removed
    assert.ok(left.length === 9 && roomOps(USUAL_ROOM, (id) => left.includes(id)).ops.every((op) => !left.includes(op.id)));
});

test('a room that the server refuses is told of, and its form stays', async () => {
    const errors: Error[] = [];
    const scene = new SceneMirror();
    let answer: () => Promise<JsonObject> = () => Promise.reject(new RpcError('too much', -32000, 'limit_exceeded', 'ops/0'));
    const edits = new Edits(scene, { call: () => answer(), onError: (e) => errors.push(e), onAccepted: () => undefined, mayEdit: () => true });
    let moved = 0;
    const imports = new Imports({ scene, edits, toasts: new Toasts(), lookAt: () => undefined, moveTo: () => moved++ });
    imports.planning.value = true;
    await imports.build(USUAL_ROOM);
    assert.deepEqual([errors.map((e) => e.message), imports.planning.value, moved], [['too much'], true, 0]);
    answer = () => Promise.resolve({});
    await imports.build(USUAL_ROOM);
    assert.deepEqual([errors.length, imports.planning.value, moved], [1, false, 1]);
});
