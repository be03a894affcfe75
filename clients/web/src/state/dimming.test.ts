import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { JsonObject } from '../protocol/rpc';
import type { SceneRecord } from '../protocol/types';
import { atLevel, fromDali, fullOf, inUnit, levelOf, levelOfAll, toDali } from './dimming';
import { fluxOf } from './lights';
import { withField } from './scene';

const light = (fields: JsonObject): SceneRecord => ({ type: 'light', id: 'l', ...fields });
const set = (record: SceneRecord, level: number, before = record): SceneRecord => {
    const op = atLevel(record, fullOf(record, before)!, level);
    assert.ok(op.op === 'set');
    return withField(record, op.path, op.value)!;
};

test('DALI counts as IEC 62386-102 tables it', () => {
    // Table of the standard: level and percent of the light.
    for (const [n, percent] of [[0, 0], [1, 0.1], [60, 0.501], [85, 0.991], [126, 3.035], [144, 4.96], [170, 10.091], [229, 50.53], [254, 100]] as const) {
        assert.ok(Math.abs(100 * fromDali(n) - percent) <= 0.0006 * Math.max(1, percent), `${n}: ${100 * fromDali(n)}`);
    }
    for (let n = 0; n <= 254; n++) assert.equal(toDali(fromDali(n)), n);
});

test('percent are of the light of the file, whichever way it was told', () => {
    const file = light({ kind: 'ies', asset: 'a.ies', photometry: { flux_lm: 3200 } });
    assert.equal(levelOf(file, fullOf(file, file)!), 1);
    const half = set(file, 0.5);
    assert.equal(half.multiplier, 0.5);
    assert.equal(fluxOf(half), 1600);
    const told = light({ kind: 'ies', asset: 'a.ies', photometry: { flux_lm: 3200 }, flux_lm: 800 });
    assert.equal(levelOf(told, fullOf(told, told)!), 0.25);
    assert.equal(set(told, 0.1).flux_lm, 320);
});

test('else they are of what it was before, in the unit that it has by now', () => {
    const before = light({ kind: 'point', flux_lm: 1000 });
    assert.equal(set(before, 0.2).flux_lm, 200);
    const otherwise = light({ kind: 'point', intensity_cd: 1000 / (8 * Math.PI) });
    assert.ok(Math.abs(levelOf(otherwise, fullOf(otherwise, before)!)! - 0.5) < 1e-9);
    assert.ok(Math.abs(Number(set(otherwise, 1, before).intensity_cd) - 1000 / (4 * Math.PI)) < 1e-3);
    assert.equal(set(light({ kind: 'point', flux_lm: 0 }), 1, before).flux_lm, 1000, 'from the dark');
    const shines = { type: 'object', id: 'o', emits: { flux_lm: 500, material_flux_lm: 2000, luminance_cd_m2: 9 } } as SceneRecord;
    assert.equal(levelOf(shines, fullOf(shines, shines)!), 0.25);
    const dark = light({ kind: 'point', flux_lm: 0 });
    assert.equal(fullOf(dark, dark), null, 'of nothing there are no percent');
});

test('what is typed in another unit is set where all have such a quantity', () => {
    const lamps = [light({ kind: 'point', flux_lm: 100 }), light({ id: 'k', kind: 'spot', flux_lm: 300 })];
    const full = (l: SceneRecord): ReturnType<typeof fullOf> => fullOf(l, lamps.find((one) => one.id === l.id)!);
    assert.deepEqual(inUnit(lamps, 50, 'cd', full)!.map((op) => op.op === 'set' && [op.id, op.path, op.value]), [['l', '/intensity_cd', 50], ['k', '/intensity_cd', 50]]);
    assert.deepEqual(inUnit(lamps, 50, '%', full)!.map((op) => op.op === 'set' && op.value), [50, 150]);
    assert.deepEqual(inUnit(lamps, 254, 'dali', full)!.map((op) => op.op === 'set' && op.value), [100, 300]);
    assert.equal(inUnit([...lamps, light({ kind: 'quad' })], 50, 'cd', full), null);
    assert.equal(inUnit(lamps, -1, 'cd', full), null);
    assert.equal(inUnit(lamps, 5, 'm', full), null);
    assert.equal(levelOfAll(lamps, full), 1);
});
