// Where must four lamps hang for the most even light on a work plane?
//
//     lumend --scene clients/python/examples/empty.jsonl        (prints a URL; a scene without objects)
//     node examples/even_light.js 'URL' [picture.png]
//
// A room of 6 x 4 x 2.8 m is built, with four lamps in two rows. The rows, and the lamps within them, are moved apart in turns by
// golden sections, and a sensor says how even the light is: Uo, the least illuminance over the mean. What is found stays in the scene.
import { writeFile } from 'node:fs/promises';
import { connect } from 'lumend';

const WIDTH = 6, DEPTH = 4, HEIGHT = 2.8, WALL = 0.1; // m
const LAMPS = [[-1, -1], [-1, 1], [1, -1], [1, 1]];
const GOLDEN = 0.6180339887;
const STEPS = Number(process.env.STEPS ?? 5); // of a golden section
const ENOUGH = Number(process.env.ENOUGH ?? 0.015); // standard error of Uo: below it the next place is tried

function build(edit) {
    edit.add('mesh', 'box', { shape: 'box' });
    edit.add('material', 'paint', { base_color: [0.7, 0.7, 0.7], specular: 0 });
    edit.add('material', 'carpet', { base_color: [0.2, 0.2, 0.2], specular: 0 });
    const half = WALL / 2;
    const walls = {
        floor: [[0, -half, 0], [WIDTH, WALL, DEPTH]],
        ceiling: [[0, HEIGHT + half, 0], [WIDTH, WALL, DEPTH]],
        west: [[-WIDTH / 2 - half, HEIGHT / 2, 0], [WALL, HEIGHT, DEPTH]],
        east: [[WIDTH / 2 + half, HEIGHT / 2, 0], [WALL, HEIGHT, DEPTH]],
        north: [[0, HEIGHT / 2, -DEPTH / 2 - half], [WIDTH, HEIGHT, WALL]],
        south: [[0, HEIGHT / 2, DEPTH / 2 + half], [WIDTH, HEIGHT, WALL]],
    };
    for (const [name, [translate, scale]] of Object.entries(walls)) {
        edit.add('object', name, { mesh: 'box', material: name === 'floor' ? 'carpet' : 'paint', transform: { translate, scale } });
    }
    LAMPS.forEach((_, i) => edit.add('light', `lamp-${i + 1}`, { kind: 'disc', radius: 0.15, flux_lm: 2500, direction: [0, -1, 0] }));
    edit.add('sensor', 'work-plane', { kind: 'grid', position: [0, 0.75, 0], u: [WIDTH - 1, 0, 0], v: [0, 0, DEPTH - 1], spacing_m: 0.5 });
    edit.add('camera', 'main', { position: [-WIDTH / 2 + 0.2, 2.2, DEPTH / 2 - 0.2], target: [0.6, 0.9, -0.6], vfov_deg: 75 });
}

function hang(edit, [along, across]) {
    LAMPS.forEach(([x, z], i) => edit.set(`lamp-${i + 1}`, { position: [(x * along) / 2, HEIGHT - 0.02, (z * across) / 2] }));
}

async function measure(session, apart) {
    await session.edit((edit) => hang(edit, apart));
    const { uo, uo_stderr: error, em_lx: mean } = await session.sensor('work-plane', (value) => value.uo_stderr < ENOUGH);
    console.log(`${apart.map((m) => m.toFixed(2)).join(' m, ')} m apart: Uo ${uo.toFixed(3)} +/- ${error.toFixed(3)}, mean ${mean.toFixed(0)} lx`);
    return uo;
}

/** Golden sections: each step measures one new place and leaves 0.618 of the interval. */
async function bestAlong(session, apart, axis, low, high) {
    const moved = (x) => apart.map((old, i) => (i === axis ? x : old));
    const uo = (x) => measure(session, moved(x));
    let a = high - GOLDEN * (high - low), b = low + GOLDEN * (high - low);
    let [uoA, uoB] = [await uo(a), await uo(b)];
    for (let step = 2; step < STEPS; step++) {
        if (uoA > uoB) {
            [high, b, uoB] = [b, a, uoA];
            a = high - GOLDEN * (high - low);
            uoA = await uo(a);
        } else {
            [low, a, uoA] = [a, b, uoB];
            b = low + GOLDEN * (high - low);
            uoB = await uo(b);
        }
    }
    return moved(uoA > uoB ? a : b);
}

const [url, path] = process.argv.slice(2);
const session = await connect(url, { client: 'even-light' });
if ([...(await session.scene()).values()].some((record) => record.type === 'object')) {
    throw new Error('there are objects in this scene already: start lumend with --scene clients/python/examples/empty.jsonl');
}
let apart = [1, 1];
await session.edit((edit) => {
    build(edit);
    hang(edit, apart);
});
const before = await measure(session, apart);
apart = await bestAlong(session, apart, 0, 1, WIDTH - 0.6);
apart = await bestAlong(session, apart, 1, 1, DEPTH - 0.6);
const now = await measure(session, apart);
console.log(`Uo ${before.toFixed(2)} before, ${now.toFixed(2)} now: lamps ${apart.map((m) => m.toFixed(2)).join(' m and ')} m apart`);
if (path) await writeFile(path, await (await (await session.view(600, 400, { spp: 16 })).picture()).png());
await session.close();
