// A line that breaks while somebody works: nothing is lost, nothing is done twice, and an old picture looks old. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { eventually, launch, open, settled } from './browser.mjs';
import { Daemon } from './daemon.mjs';
import { Line } from './line.mjs';

const ROOM = fileURLToPath(new URL('room.jsonl', import.meta.url));

const line = new Line();
let daemon, context, tab, page, other;

before(async () => {
    daemon = new Daemon(ROOM);
    await daemon.start();
    await line.start(daemon.port);
    context = await launch();
    tab = await open(context, daemon.url.replace(`:${daemon.port}`, `:${line.port}`));
    other = await open(context, daemon.url);
    page = tab.page;
    for (const { page: p } of [tab, other]) await p.getByLabel('Resolution').selectOption('fast');
    await settled(tab);
    await settled(other);
});

after(async () => {
    await context?.close();
    await line.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, `exit status of the daemon\n${daemon.log}`);
});

const isOn = (p, id) => p.getByLabel(`${id} on`, { exact: true }).getAttribute('aria-checked');
const applied = (t) => t.watch.sent.filter((m) => m.method === 'scene.apply');
const again = async () => {
    line.open = true;
    await page.locator('.banner').waitFor({ state: 'detached' });
};

for (const [when, cut] of [['before it reached the server', { direction: 'up', before: true }], ['before the answer', { direction: 'down', before: true }]])
    test(`an edit whose line was cut ${when} is done once`, async () => {
        const was = await isOn(page, 'accent');
        const sent = applied(tab).length;
        // The next bytes up are those of the edit: all else has been answered, and the beat comes every two seconds.
        await page.getByLabel('accent on', { exact: true }).evaluate((button) => button.click());
        line.cut = cut;
        await eventually(() => !line.open, () => 'the line was not cut');
        await page.locator('.banner-lost').waitFor();
        await page.locator('.picture.is-stale').waitFor();
        assert.equal(await page.locator('.quality').textContent(), 'not connected');
        await again();
        await eventually(async () => (await isOn(page, 'accent')) !== was, () => 'the edit was lost');
        await page.locator('.picture:not(.is-stale)').waitFor();
        await eventually(async () => (await isOn(other.page, 'accent')) !== was, () => 'the other does not see it');
        const mine = applied(tab).slice(sent);
        assert.equal(new Set(mine.map((m) => m.params.op_id)).size, 1);
        await page.getByLabel('Undo (Z)').click();
        await eventually(async () => (await isOn(page, 'accent')) === was, () => 'one undo does not take it back');
    });

test('what somebody else changed meanwhile is told with who and what, and is there without the scene being got anew', async () => {
    const gets = () => tab.watch.sent.filter((m) => m.method === 'scene.get').length;
    const before = gets();
    const was = await isOn(page, 'ceiling-panel');
    await page.getByLabel('Solo accent').click();
    await settled(tab);
    line.break();
    await page.locator('.banner-lost').waitFor();
    await other.page.getByLabel('ceiling-panel on', { exact: true }).click();
    await eventually(async () => (await isOn(other.page, 'ceiling-panel')) !== was, () => 'the other did not change it');
    assert.equal(await isOn(page, 'ceiling-panel'), was, 'nobody told');
    await again();
    await page.locator('.toast', { hasText: 'While you were away lumend-web changed ceiling-panel' }).waitFor();
    assert.notEqual(await isOn(page, 'ceiling-panel'), was);
    assert.equal(gets(), before);
    assert.equal(await page.getByLabel('Solo accent').getAttribute('aria-pressed'), 'true', 'what is shown alone still is');
    const opened = tab.watch.sent.filter((m) => m.method === 'view.open').at(-1);
    assert.deepEqual(opened.params.solo, ['accent']);
    await page.locator('.picture:not(.is-stale)').waitFor();
});
