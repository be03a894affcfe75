// What a file of browser tests stands on: one daemon and one browser, from its first test to its last. Each file runs in a
// process of its own, so that these are its alone.
import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before } from 'node:test';
import { fileURLToPath } from 'node:url';
import { field, launch, open, settled, shownRev } from './browser.mjs';
import { Daemon } from './daemon.mjs';

export const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));
/** The lines of room.jsonl that are edits. */
export const roomOps = () => readFileSync(ROOM, 'utf8').split('\n').filter((line) => line.includes('"op"'));
const AXE = readFileSync(createRequire(new URL('../../../clients/web/package.json', import.meta.url)).resolve('axe-core/axe.min.js'), 'utf8');

export let context;
/** The page and what was seen on its wire. */
export let tab;
export let page;

/** Before the file's tests a browser opens the daemon's scene, in small pictures: tests are about what changes, not how fine
 * it is. After them both end, and the daemon without a fault. */
export function serve(...daemonArguments) {
    const daemon = new Daemon(...daemonArguments);
    before(async () => {
        await daemon.start();
        context = await launch();
        tab = await open(context, daemon.url);
        page = tab.page;
        await page.getByLabel('Resolution').selectOption('fast');
        await settled(tab);
    });
    after(async () => {
        await context?.close();
        if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
    });
    return daemon;
}

/** Does something to the scene, and waits until the picture shows it. */
export async function edit(action, spp = 2) {
    const rev = await shownRev(page);
    await action();
    await settled(tab, { rev: rev + 1, spp });
}

/** Numbers that the line of a lamp shows. */
export const numbers = (id, ...labels) => Promise.all(labels.map(async (label) => Number(await field(page, id, label).inputValue())));

/** Pictures rest soon, or the daemon would compute all the time that the page leaves it: as those of room.jsonl do. */
const FEW_SAMPLES = '{"op": "set", "id": "render", "path": "/spp", "value": 12}';

/** A file of ops, as a scene. */
export function sceneFile(ops) {
    const file = join(mkdtempSync(join(tmpdir(), 'lumend-e2e-')), 'scene.jsonl');
    writeFileSync(file, ['{"lumend": 1, "kind": "scene"}', FEW_SAMPLES, ...ops, ''].join('\n'));
    return file;
}

/** A daemon of its own for a scene of these ops, and a tab that looks at it. */
export async function withScene(ops, assets, look) {
    const own = new Daemon(sceneFile(ops), assets);
    await own.start();
    try {
        const other = await open(context, own.url);
        await other.page.getByLabel('Resolution').selectOption('fast');
        await look(other, own);
        await other.page.close();
    } finally {
        assert.equal(await own.stop(), 0, own.log);
    }
}

/** What axe finds against WCAG 2.2 A and AA. */
export async function violations(p) {
    if (!(await p.evaluate(() => 'axe' in window))) await p.evaluate(AXE);
    const found = await p.evaluate(() =>
        window.axe.run(document, { runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] }).then((r) => r.violations),
    );
    return found.flatMap((v) => v.nodes.map((n) => `${v.id}: ${n.html.slice(0, 200)}: ${n.any.concat(n.all, n.none).map((c) => c.message).join('; ')}`));
}
