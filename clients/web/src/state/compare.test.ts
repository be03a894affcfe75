import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { CameraPose } from '../protocol/types';
import { Compare, differences, factsInWords, MOST_KEPT, sameCamera, type PictureFacts, type Shot } from './compare';

const POSE: CameraPose = { position: [0, 1, 5], target: [0, 1, 0], up: [0, 1, 0], vfov_deg: 45 };
const FACTS: PictureFacts = { rev: 3, method: 'live', spp: 64, bound: 0.008, ev: 8, map: 'none', solo: [], pose: POSE };

/** A canvas that knows which one was drawn on it. */
function canvas(width = 8, height = 6, picture = ''): HTMLCanvasElement {
    const made = { width, height, picture, getContext: () => ({ drawImage: (from: { picture: string }) => (made.picture = from.picture) }) };
    return Object.assign(made, { ownerDocument: { createElement: () => canvas() } }) as unknown as HTMLCanvasElement;
}
const pictureOf = (shot: Shot | null | undefined): string => (shot?.canvas as unknown as { picture: string }).picture;

function made(now: () => Shot | null = () => ({ name: 'Now', facts: FACTS, canvas: canvas(8, 6, 'now') })): { compare: Compare; said: string[] } {
    const said: string[] = [];
    return { compare: new Compare({ now, announce: (text) => said.push(text) }), said };
}

test('a picture that is kept stays as it was, with what it showed, under a name that can be changed', () => {
    let picture = 'before';
    let rev = 3;
    const { compare, said } = made(() => ({ name: 'Now', facts: { ...FACTS, rev }, canvas: canvas(8, 6, picture) }));
    const key = compare.keep()!.key;
    [picture, rev] = ['after', 4];
    assert.equal(pictureOf(compare.keptOf(key)), 'before');
    assert.equal(compare.keptOf(key)!.facts.rev, 3);
    assert.deepEqual(said, ['Kept as Picture 1: live, 64 samples, at most 0.8\u00a0% off, revision 3']);
    compare.rename(key, '  warm ');
    compare.rename(key, ' ');
    assert.equal(compare.nameOf(key), 'warm');
    assert.equal(compare.keep()!.name, 'Picture 2');
});

test('nothing is kept where there is no picture', () => {
    const { compare, said } = made(() => null);
    assert.equal(compare.keep(), null);
    assert.deepEqual([compare.kept.value.length, said], [0, ['There is no picture yet']]);
});

test('of more than fits the oldest goes, and with it the wipe that shows it', () => {
    const { compare } = made();
    const first = compare.keep()!.key;
    compare.show(first);
    for (let i = 1; i < MOST_KEPT; i++) compare.keep();
    assert.equal(compare.kept.value.length, MOST_KEPT);
    assert.deepEqual(compare.sides.value, [first, 'now']);
    compare.keep();
    assert.equal(compare.kept.value.length, MOST_KEPT);
    assert.deepEqual([compare.keptOf(first), compare.sides.value], [undefined, null]);
    // Large ones are fewer: 4000 x 3000 pixels each.
    const large = made(() => ({ name: 'Now', facts: FACTS, canvas: canvas(4000, 3000) })).compare;
    for (let i = 0; i < 6; i++) large.keep();
    assert.equal(large.kept.value.length, 4);
});

test('the wipe opens with what was compared last, else the newest picture, else the reference', () => {
    const { compare } = made();
    compare.toggle();
    assert.deepEqual(compare.sides.value, ['reference', 'now']);
    assert.equal(compare.takeFocus(), true);
    assert.equal(compare.takeFocus(), false, 'once');
    compare.toggle();
    assert.equal(compare.sides.value, null);
    const [a, b] = [compare.keep()!.key, compare.keep()!.key];
    compare.show(a, b);
    compare.close();
    compare.toggle();
    assert.deepEqual(compare.sides.value, [a, b]);
    compare.forget(a);
    assert.equal(compare.sides.value, null);
    compare.toggle();
    assert.deepEqual(compare.sides.value, [b, 'now']);
    assert.equal(compare.wantsReference.value, false);
});

test('what was there before the last change needs no keeping, and is one picture', () => {
    let picture = 'first';
    const { compare, said } = made(() => ({ name: 'Now', facts: FACTS, canvas: canvas(8, 6, picture) }));
    assert.equal(compare.shotOf('before'), null);
    compare.changing();
    const copy = compare.shotOf('before')!.canvas;
    picture = 'second';
    compare.changing();
    assert.equal(compare.shotOf('before')!.canvas, copy);
    assert.equal(pictureOf(compare.shotOf('before')), 'second');
    assert.deepEqual([compare.kept.value.length, said], [0, []]);
    compare.toggle();
    assert.deepEqual(compare.sides.value, ['before', 'now']);
});

test('two sides never show the same: what was there changes sides', () => {
    const { compare } = made();
    const a = compare.keep()!.key;
    compare.show(a);
    compare.choose(0, 'now');
    assert.deepEqual(compare.sides.value, ['now', a]);
    compare.choose(1, 'reference');
    assert.deepEqual(compare.sides.value, ['now', 'reference']);
    assert.equal(compare.wantsReference.value, true);
});

test('the line stays in the picture, and flips between all of one and all of the other', () => {
    const { compare } = made();
    compare.moveTo(-0.3);
    assert.equal(compare.at.value, 0);
    compare.moveTo(1.2);
    assert.equal(compare.at.value, 1);
    compare.flip();
    assert.equal(compare.at.value, 0);
    compare.flip();
    assert.equal(compare.at.value, 1);
});

test('cameras are the same but for rounding', () => {
    assert.ok(sameCamera(POSE, { ...POSE, position: [0, 1, 5.0001], up: [0, 2, 0.1] }), 'up is but a hint');
    for (const other of [{ position: [0, 1, 5.1] as const }, { target: [0.1, 1, 0] as const }, { up: [0.1, 1, 0] as const }, { vfov_deg: 46 }])
        assert.ok(!sameCamera(POSE, { ...POSE, ...other }), JSON.stringify(other));
});

test('what makes pictures differ apart from their light is said', () => {
    assert.deepEqual(differences(FACTS, { ...FACTS, rev: 9, method: 'path', spp: 1 }), []);
    const darker = { ...FACTS, ev: 9.5, solo: ['lamp'] };
    assert.deepEqual(differences(FACTS, darker), ['exposed for 9.5 EV, not 8.0', 'only lamp']);
    assert.deepEqual(differences(darker, FACTS), ['exposed for 8.0 EV, not 9.5', 'all lamps']);
    assert.deepEqual(differences(FACTS, { ...darker, pose: { ...POSE, vfov_deg: 60 } }), ['another camera', 'only lamp'], 'each camera has its exposure');
    assert.deepEqual(differences(FACTS, { ...FACTS, map: 'illuminance', ev: 3 }), ['map of illuminance'], 'maps are not exposed');
    assert.equal(factsInWords({ ...FACTS, spp: 0, bound: null }), 'live, rough, error not known, revision 3');
    assert.equal(factsInWords({ ...FACTS, spp: 1, bound: 1.8 }), 'live, 1 sample, error not known, revision 3');
});
