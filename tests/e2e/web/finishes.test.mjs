// The finishes of the material panel under an even sky, where a surface is as bright as what it reflects and lets through: the
// shares that the panel states are those that the renderer gives. No browser: the client's own tables, and a daemon.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { Daemon } from './daemon.mjs';
import { sceneFile } from './stage.mjs';

const { build } = createRequire(new URL('../../../clients/web/package.json', import.meta.url))('esbuild');
const clients = fileURLToPath(new URL('../../../clients', import.meta.url));

async function load(path) {
    const outfile = join(clients, 'web/node_modules/.cache/finishes', `${path}.mjs`); // beside ws, which it asks for
    await build({ entryPoints: [join(clients, path)], outfile, bundle: true, platform: 'node', format: 'esm', target: 'node18', logLevel: 'warning' });
    return import(pathToFileURL(outfile));
}

const SKY = 1000; // cd/m2
const SIDE = 9; // pixels of each square, of which the middle ones count
const COLUMNS = 7;
/** Found: 0.002, what tables lose between their nodes. Of rough panes the panel says what smooth ones do: 0.012. */
const TOLERANCE = 0.004;
const ROUGH_PANE = 0.016;
/** Beside what the panel states: surfaces between its finishes, where its formula must hold as well. */
const MORE = [
    { roughness: 1, base_color: [0.2, 0.3, 0.1] },
    { roughness: 0.7, base_color: [0.5, 0.5, 0.5], specular: 0.6, clearcoat: 0.5, clearcoat_roughness: 0.2 },
    { metallic: 1, roughness: 0.8, base_color: [0.9, 0.6, 0.3] },
    { metallic: 0.5, roughness: 0.4, base_color: [0.6, 0.6, 0.6], ior: 1.8 },
    { metallic: 1, roughness: 0.2, base_color: [0.9, 0.9, 0.9], anisotropy: 0.8 },
    { roughness: 0.6, base_color: [0.3, 0.4, 0.5], diffuse_transmittance: [0.5, 0.4, 0.3] },
    { roughness: 0, transmission: 1, thin: true, base_color: [0.5, 0.9, 0.7], ior: 1.6 },
];

/** Squares in rows, each before black where told so, seen at right angles from so far that all are seen alike. */
function squares(materials, backed) {
    const matt = { roughness: 1, specular: 0 };
    const ops = [
        { op: 'add', type: 'material', id: 'black', base_color: [0, 0, 0], ...matt },
        { op: 'add', type: 'mesh', id: 'square', shape: 'quad', size: [1, 0, 1] },
        { op: 'add', type: 'light', id: 'sky', kind: 'environment', luminance_cd_m2: SKY },
    ];
    const rows = Math.ceil(materials.length / COLUMNS);
    materials.forEach((m, i) => {
        const put = (id, material, z) => ops.push({ op: 'add', type: 'object', id, mesh: 'square', material, transform: { translate: [(i % COLUMNS) + 0.5 - COLUMNS / 2, rows / 2 - 0.5 - Math.floor(i / COLUMNS), z], rotate_deg: [90, 0, 0] } });
        ops.push({ op: 'add', type: 'material', id: `m${i}`, ...m });
        put(`square-${i}`, `m${i}`, 0);
        if (backed) put(`back-${i}`, 'black', -1e-3);
    });
    ops.push({ op: 'add', type: 'camera', id: 'main', position: [0, 0, rows / 2 / Math.tan(Math.PI / 360)], target: [0, 0, 0], vfov_deg: 1 });
    return sceneFile(ops.map((op) => JSON.stringify(op)));
}

async function brightness(lumend, materials, backed) {
    const daemon = new Daemon(squares(materials, backed), null, ['--deterministic']);
    await daemon.start();
    try {
        const session = await lumend.connect(daemon.url);
        const view = await session.view(SIDE * COLUMNS, SIDE * Math.ceil(materials.length / COLUMNS), { linear: true, method: 'path', spp: 256 });
        const light = (await view.picture()).luminance();
        await session.close();
        return materials.map((_, i) => {
            const corner = SIDE * (SIDE * COLUMNS * Math.floor(i / COLUMNS) + (i % COLUMNS));
            let sum = 0, n = 0;
            for (let y = 2; y < SIDE - 2; y++) for (let x = 2; x < SIDE - 2; x++, n++) sum += light[corner + SIDE * COLUMNS * y + x];
            return sum / n / SKY;
        });
    } finally {
        assert.equal(await daemon.stop(), 0, daemon.log);
    }
}

test('finishes reflect and let through what the panel says', async () => {
    const [lumend, { FINISHES, fieldsOf }, { lightOf }] = await Promise.all([load('js/src/index.ts'), load('web/src/state/finishes.ts'), load('web/src/state/material.ts')]);
    const fields = [...FINISHES.map((f) => fieldsOf(f)), ...MORE];
    const known = fields.map((m) => Object.fromEntries(Object.entries(m).filter(([, v]) => v !== null)));
    const rho = await brightness(lumend, known, true);
    const both = await brightness(lumend, known, false);
    const wrong = [];
    known.forEach((m, i) => {
        const name = FINISHES[i]?.name ?? `surface ${i - FINISHES.length}`;
        const said = lightOf(m);
        const facts = `${name}: said ${said.rho.toFixed(3)} and ${said.tau.toFixed(3)}, measured ${rho[i].toFixed(3)} and ${(both[i] - rho[i]).toFixed(3)}`;
        if (process.env.LUMEND_SHOW) console.log(facts);
        const most = m.transmission > 0 && m.roughness > 0 ? ROUGH_PANE : TOLERANCE;
        const { rho: stated = rho[i], tau: statedTau = both[i] - rho[i] } = FINISHES[i] ?? {};
        const off = [said.rho - rho[i], said.tau - (both[i] - rho[i]), stated - rho[i], statedTau - (both[i] - rho[i])];
        if (off.some((d) => !(Math.abs(d) < most))) wrong.push(facts);
    });
    assert.deepEqual(wrong, []);
});
