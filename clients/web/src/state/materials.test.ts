import assert from 'node:assert/strict';
import { test } from 'node:test';
import { FINISHES, fieldsOf, finishOf } from './finishes';
import { baseFor, hasHaze, hazeOf, isUsed, lightOf, mapsOf, roughnessFor, sheetFor, within } from './material';

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

test('haze of a thin pane is that of its facets, and comes back from the roughness that it asks for', () => {
    const pane = { base_color: [0.9, 0.9, 0.9], transmission: 1, thin: true, roughness: 0 };
    assert.equal(hazeOf(pane), 0);
    // Half of GGX's facets lean by more than 1.25 degrees where that is alpha: numeric.bsdf_limits has it of the renderer.
    near(roughnessFor(pane, 0.5), Math.sqrt(Math.tan((1.25 * Math.PI) / 180)), 1e-5, 'half');
    for (const haze of [0.003, 0.01, 0.1, 0.3, 0.5, 0.9, 0.99, 0.999]) near(hazeOf({ ...pane, roughness: roughnessFor(pane, haze) }), haze, 1e-4, `${haze}`);
    assert.ok(roughnessFor(pane, 0) < 1e-4, 'clear');
    assert.equal(roughnessFor(pane, 1), 1, 'as hazy as it can be');
    let before = -1;
    for (let r = 0; r <= 1; r += 0.01) {
        const haze = hazeOf({ ...pane, roughness: r });
        assert.ok(haze >= before && haze <= 1, `${r}`);
        before = haze;
    }
    // A sheet in part: what it passes evenly is haze whatever its roughness, but for sin^2 of 2.5 degrees.
    const opal = { ...pane, base_color: [0.3, 0.3, 0.3], transmission: 0.5, specular: 0, diffuse_transmittance: [0.6, 0.6, 0.6] };
    near(hazeOf(opal), (0.3 / 0.45) * Math.cos((2.5 * Math.PI) / 180) ** 2, 1e-9, 'opal');
    near(hazeOf({ ...opal, roughness: roughnessFor(opal, 0.8) }), 0.8, 1e-4, 'frosted opal');
    for (const other of [{ thin: false }, { transmission: 0 }, { anisotropy: 0.5 }, { ior: 1 }, { base_color: [0, 0, 0] }]) assert.equal(hasHaze({ ...pane, ...other }), false);
    assert.equal(hasHaze(pane), true);
});

test('pictures of a material are named', () => {
    assert.deepEqual(mapsOf({ type: 'material', id: 'm', specular_texture: { image: 'a' }, transmission_texture: null, clearcoat_texture: { image: 'a' } }), ['gloss', 'lacquer']);
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
