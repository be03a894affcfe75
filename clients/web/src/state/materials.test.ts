import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FINISHES, fieldsOf, finishOf } from './finishes';
import { baseFor, isUsed, lightOf, sheetFor, within } from './material';

const near = (a: number, b: number, most: number, what: string): void => assert.ok(Math.abs(a - b) <= most, `${what}: ${a}, not ${b}`);

test('reflectance in closed forms', () => {
    near(lightOf({ base_color: [0.5, 0.5, 0.5], specular: 0 }).rho, 0.5, 1e-12, 'matt');
    // A smooth face of index 1.5 reflects 0.04 at a right angle, and leaves the rest to what lies below.
    near(lightOf({ base_color: [0.5, 0.5, 0.5], roughness: 0 }).rho, 0.04 + 0.96 * 0.5, 1e-12, 'gloss');
    near(lightOf({ base_color: [1, 1, 1], clearcoat: 1, metallic: 1, roughness: 0.7 }).rho, 1, 1e-9, 'white keeps all');
    const pane = lightOf({ base_color: [1, 1, 1], transmission: 1, thin: true, roughness: 0 });
    near(pane.tau, 0.96 / 1.04, 1e-9, 'two faces');
    near(pane.rho + pane.tau, 1, 1e-9, 'clear glass keeps nothing');
    assert.equal(lightOf({ transmission: 1 }).solid, true);
});

test('the colour for a reflectance has it, keeps its hue, and is not brighter than white', () => {
    for (const fields of [{}, { specular: 0 }, { roughness: 0.3 }, { metallic: 1, roughness: 0.6 }, { clearcoat: 1, roughness: 0.5 }]) {
        const base = baseFor(fields, 0.4, [0.8, 0.4, 0.2]);
        near(lightOf(fields, base).rho, 0.4, 1e-3, JSON.stringify(fields));
        near(base[0] / base[1], 2, 2e-3, 'hue');
    }
    assert.deepEqual(baseFor({ specular: 0 }, 1, [0.5, 0.25, 0.125]), [1, 0.5, 0.25], 'as bright as it can be');
    assert.deepEqual(baseFor({ specular: 0 }, 0.3, [0, 0, 0]), [0.3, 0.3, 0.3], 'black has no hue');
});

test('a sheet never gives more than it gets', () => {
    const m = { base_color: [0.7, 0.5, 0.3], specular: 0 };
    assert.deepEqual(sheetFor(m, 0.9), [0.3, 0.3, 0.3]);
    assert.deepEqual(baseFor({ specular: 0, diffuse_transmittance: [0.4, 0.4, 0.4] }, 0.9), [0.6, 0.6, 0.6]);
    assert.deepEqual(within([1, 0.2, 0.5], [0.4, 0.4, 0.4]), [0.6, 0.2, 0.5]);
    near(lightOf({ ...m, diffuse_transmittance: [...sheetFor(m, 0.2)] }).tau, 0.2, 1e-3, 'tau');
    // Of what is no number of four digits there is not more left than there is.
    for (const odd of [0.33335, 0.12345678, 0.99999, 2 / 3]) {
        const other: [number, number, number] = [odd, odd, odd];
        for (const c of [within([1, 1, 1], other), baseFor({ specular: 0, diffuse_transmittance: other }, 1), sheetFor({ base_color: other, specular: 0 }, 1)]) {
            for (const v of c) assert.ok(v >= 0 && v + odd <= 1 && v + odd > 1 - 2e-4, `${v} beside ${odd}`);
        }
    }
});

test('every finish has what it states, fits its sheet, and is known again', () => {
    assert.ok(FINISHES.length > 20);
    for (const f of FINISHES) {
        const m = fieldsOf(f);
        const { rho, tau } = lightOf(m);
        if (f.rho !== undefined) near(rho, f.rho, 1e-3, f.name);
        if (f.tau !== undefined) near(tau, f.tau, 1e-3, f.name);
        assert.ok(rho + tau <= 1, f.name);
        const [base, far] = [m.base_color as number[], m.diffuse_transmittance as number[]];
        base.forEach((b, i) => assert.ok(b + far[i]! <= 1 + 1e-9, f.name));
        // As the server tells it: fields at their defaults are left out.
        const told = Object.fromEntries(Object.entries(m).filter(([key, v]) => key === 'specular' || key === 'roughness' || (v !== null && v !== 0 && v !== false)));
        assert.equal(finishOf(told)?.name, FINISHES.find((g) => JSON.stringify(fieldsOf(g)) === JSON.stringify(m))?.name);
    }
    assert.equal(finishOf({ base_color: [0.1, 0.2, 0.3] }), null);
    assert.equal(isUsed({ sheen_color: [0, 0, 0] }, 'cloth'), false);
    assert.equal(isUsed({ diffuse_transmittance: [0, 0.1, 0] }, 'sheet'), true);
});
