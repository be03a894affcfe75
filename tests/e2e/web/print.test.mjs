// The report on paper: A4, no row and no picture cut in two, no heading left alone, heads of tables on each page.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { launch } from './browser.mjs';

const LAMPS = 45;
const POINTS = 40;
const folder = mkdtempSync(join(tmpdir(), 'lumend-print-'));
let context, page;

/** Tables of more than a page (of lamps that are mostly off: they cost no ray), and plans that are wide, high and in between. */
function scene() {
    const ops = [
        { type: 'mesh', id: 'box', shape: 'box', size: [8, 3, 6] },
        { type: 'material', id: 'white', base_color: [0.7, 0.7, 0.7], specular: 0 },
        { type: 'object', id: 'room', mesh: 'box', material: 'white', transform: { translate: [0, 1.5, 0] } },
        { type: 'camera', id: 'main', position: [3.5, 1.6, 2.5], target: [0, 1, 0] },
        { type: 'sensor', id: 'wide', kind: 'grid', position: [0, 0.75, 0], u: [7, 0, 0], v: [0, 0, 1], spacing_m: 0.3, name: 'a name that is '.repeat(6) },
        { type: 'sensor', id: 'high', kind: 'grid', position: [0, 0.75, 0], u: [1, 0, 0], v: [0, 0, 5], spacing_m: 0.1 },
        { type: 'sensor', id: 'even', kind: 'grid', position: [0, 0.75, 0], u: [5, 0, 0], v: [0, 0, 5], target_lx: 10, target_uo: 0.01 },
    ];
    for (let i = 0; i < LAMPS; i++)
        ops.push({ type: 'light', id: `lamp-${i}`, kind: 'point', position: [(i % 9) * 0.7 - 3, 2.5, Math.floor(i / 9) - 2], flux_lm: 200 + 10 * i, on: i % 20 === 0 });
    for (let i = 0; i < POINTS; i++) ops.push({ type: 'sensor', id: `point-${i}`, kind: 'point', position: [i * 0.1 - 2, 1, 1], normal: [0, 1, 0] });
    return [{ lumend: 1, kind: 'scene' }, ...ops.map((op) => ({ op: 'add', ...op }))].map((line) => `${JSON.stringify(line)}\n`).join('');
}

before(async () => {
    writeFileSync(join(folder, 'print.jsonl'), scene());
    const words = ['measure', '--scene', 'print.jsonl', '--error', '1', '--pictures', '1', '--html', 'print.html'];
    execFileSync(process.env.LUMEND, words, { cwd: folder, stdio: 'ignore' });
    context = await launch();
    page = await context.newPage();
    await page.goto(pathToFileURL(join(folder, 'print.html')).href);
});
after(async () => {
    await context?.close();
    rmSync(folder, { recursive: true });
});

test('it is of pages of A4', async () => {
    const pdf = (await page.pdf({ preferCSSPageSize: true })).toString('latin1');
    const boxes = [...pdf.matchAll(/\/MediaBox\s*\[0 0 ([\d.]+) ([\d.]+)\]/g)];
    assert.ok(boxes.length > 3);
    for (const [, width, height] of boxes) assert.ok(Math.abs(width - 595) < 1 && Math.abs(height - 842) < 1, `${width} x ${height} points`);
});

// Columns as wide and high as what is between the margins break as pages do, and unlike those a script can look at them.
test('nothing is cut that belongs together', async () => {
    await page.emulateMedia({ media: 'print' });
    await page.addStyleTag({ content: 'html { width: 182mm } body { height: 265mm; columns: auto 182mm; column-gap: 10mm; column-fill: auto }' });
    const seen = await page.evaluate(() => {
        const columnOf = (rect) => Math.round(rect.left / ((192 / 25.4) * 96));
        const first = (e) => columnOf(e.getClientRects()[0]);
        const cut = [...document.querySelectorAll('tbody tr, tfoot tr, figure, img, svg, .key, section:has(svg)')].filter((e) => e.getClientRects().length !== 1);
        const tooWide = [...document.querySelectorAll('table, img, svg, p')].filter((e) => e.getClientRects()[0].width > (182 / 25.4) * 96 + 1);
        return {
            cut: cut.map((e) => e.outerHTML.slice(0, 80)),
            tooWide: tooWide.map((e) => e.outerHTML.slice(0, 80)),
            alone: [...document.querySelectorAll('h2')].filter((h) => first(h) !== first(h.nextElementSibling)).map((h) => h.textContent),
            pages: [...document.querySelectorAll('table')].map((t) => t.getClientRects().length),
            heads: [...document.querySelectorAll('thead')].map((t) => t.getClientRects().length),
            plans: document.querySelectorAll('svg').length,
        };
    });
    assert.deepEqual([seen.cut, seen.tooWide, seen.alone], [[], [], []]);
    assert.ok(seen.pages.length === 2 && seen.pages.every((n) => n > 1), 'both tables go over more than a page');
    assert.deepEqual(seen.heads, seen.pages, 'each page of a table has its head');
    assert.equal(seen.plans, 3);
});
