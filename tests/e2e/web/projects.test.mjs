// Many scenes: made, opened, copied, named, deleted and brought back in the browser, by keyboard.
import assert from 'node:assert/strict';
import { mkdtempSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { eventually, launch, open, settled } from './browser.mjs';
import { Daemon } from './daemon.mjs';
import { violations } from './stage.mjs';

const SHOTS = process.env.LUMEND_SHOTS;
const daemon = new Daemon(null, null, ['--projects', mkdtempSync(join(tmpdir(), 'lumend-e2e-'))]);
let context;
let tab;
let page;

before(async () => {
    await daemon.start();
    context = await launch();
    tab = await open(context, daemon.url);
    page = tab.page;
});
after(async () => {
    await context?.close();
    if (daemon.child) assert.equal(await daemon.stop(), 0, daemon.log);
});

const names = () => page.locator('.project-name').allTextContents();

async function shot(name, of = page) {
    if (!SHOTS) return;
    for (const [width, height] of [[1440, 900], [400, 800]]) {
        await of.setViewportSize({ width, height });
        await of.screenshot({ path: join(SHOTS, `${name}-${width}.png`) });
    }
    await of.setViewportSize({ width: 1280, height: 720 });
}

async function openMore(name) {
    const more = page.getByRole('button', { name: `More of ${name}`, exact: true });
    if ((await more.getAttribute('aria-expanded')) === 'false') await more.press('Enter');
}

test('projects are made, copied, kept, deleted and brought back', async () => {
    await page.getByRole('heading', { name: 'Projects' }).waitFor();
    await shot('none');
    await page.getByLabel('Name of a new project').fill('Foyer <b>');
    await page.getByLabel('Begin with').selectOption('furnace');
    await page.getByRole('button', { name: 'Create' }).press('Enter');
    await page.waitForURL(/\?project=[a-z0-9]{12}$/);
    await settled(tab);
    await page.getByLabel('Resolution').selectOption('fast');
    await settled(tab);
    assert.equal(await page.title(), 'Foyer <b> – lumend');
    await page.locator('.kept', { hasText: 'saved' }).waitFor();
    await shot('scene');

    await page.getByRole('button', { name: 'Foyer <b>', exact: true }).press('Enter');
    const dialog = page.getByRole('dialog', { name: 'Projects' });
    await dialog.getByText('open here').waitFor();
    await openMore('Foyer <b>');
    await dialog.getByLabel('Name of a version of Foyer <b>').fill('Empty');
    await page.keyboard.press('Enter');
    await dialog.getByText('Empty', { exact: false }).first().waitFor();
    await dialog.getByRole('button', { name: 'Duplicate' }).press('Enter');
    await eventually(async () => (await names()).includes('Foyer <b>, copy'), names);
    assert.equal(await dialog.getByRole('button', { name: 'Delete' }).isDisabled(), true); // somebody is in it: we are
    assert.deepEqual(await violations(page), []);
    await shot('dialog');

    await page.reload(); // the address says which
    await settled(tab);
    await page.getByRole('button', { name: 'Foyer <b>', exact: true }).press('Enter');
    await dialog.getByLabel('Name of the copy').fill('Evening');
    await page.keyboard.press('Enter');
    await page.waitForFunction(() => document.title === 'Evening – lumend');
    await settled(tab);
    await page.getByRole('button', { name: 'Evening', exact: true }).press('Enter');
    await openMore('Evening');
    await dialog.getByLabel('Name of Evening', { exact: true }).fill('Evening, 2nd');
    await page.keyboard.press('Enter');
    await eventually(async () => (await names()).includes('Evening, 2nd'), names);
    await page.keyboard.press('Escape');
    await page.getByRole('button', { name: 'Evening, 2nd', exact: true }).waitFor();

    await page.goto(new URL('/', daemon.url).href);
    await eventually(async () => (await names()).length === 3, names);
    await openMore('Foyer <b>, copy');
    await page.getByRole('button', { name: 'Delete' }).press('Enter');
    await page.getByText('Foyer <b>, copy is in the trash.').waitFor();
    assert.equal((await names()).length, 2);
    await page.locator('summary').press('Enter');
    assert.deepEqual(await violations(page), []);
    await shot('start');
    await page.getByRole('button', { name: 'Undo' }).press('Enter');
    await eventually(async () => (await names()).length === 3, names);
    await openMore('Foyer <b>');
    await page.getByRole('button', { name: 'New project of it: Empty' }).press('Enter');
    await page.waitForFunction(() => document.title === 'Foyer <b>, Empty – lumend');
    assert.deepEqual(tab.watch.errors, []);
});

test('a link to what is not there leads to the list, and says why', async () => {
    await page.goto(new URL('/?project=aaaaaaaaaaaa', daemon.url).href);
    await page.getByRole('alert').getByText('there is no such project').waitFor();
    await eventually(async () => (await names()).length === 4, names);
    await page.locator('.project-name').first().press('Enter');
    await settled(tab);
    assert.deepEqual(tab.watch.errors, []);
});

test('the trash is emptied by keyboard, after a question', async () => {
    const empty = new Daemon(null, null, ['--projects', mkdtempSync(join(tmpdir(), 'lumend-e2e-'))]);
    await empty.start();
    try {
        const other = await open(context, empty.url);
        const at = other.page;
        const trash = at.locator('.project-trash');
        const focused = () => at.evaluate(() => document.activeElement.textContent);
        for (const name of ['A "1"', 'B', 'C']) {
            await at.getByLabel('Name of a new project').fill(name);
            await at.getByRole('button', { name: 'Create' }).press('Enter');
            await at.waitForURL(/\?project=/);
            await settled(other);
            await at.goto(new URL('/', empty.url).href);
            const more = at.getByRole('button', { name: `More of ${name}`, exact: true });
            await more.press('Enter');
            const remove = at.getByRole('button', { name: 'Delete', exact: true });
            await eventually(() => remove.isEnabled(), () => 'nobody is in it any more'); // the server hears that the page left
            await remove.press('Enter');
            await at.getByText(`${name} is in the trash.`).waitFor();
        }
        await trash.locator('summary').press('Enter');
        const ask = at.getByRole('button', { name: 'Delete for ever: A "1"' });
        await ask.press('Enter');
        await at.getByRole('group', { name: 'Delete A "1" for ever?' }).waitFor();
        assert.equal(await focused(), 'Keep'); // Enter twice does no harm
        assert.deepEqual(await violations(at), []);
        await shot('trash', at);
        await at.keyboard.press('Escape');
        await eventually(async () => (await focused()) === 'Delete for ever', focused);
        await at.keyboard.press('Enter');
        await at.keyboard.press('Shift+Tab');
        await at.keyboard.press('Enter');
        await eventually(async () => (await trash.locator('li').count()) === 2, () => trash.textContent());
        await eventually(async () => (await focused()) === 'Trash (2)', focused);
        await trash.getByRole('button', { name: 'Empty trash' }).press('Enter');
        await at.getByRole('group', { name: 'Delete all that is in the trash for ever?' }).waitFor();
        await at.keyboard.press('Shift+Tab');
        await at.keyboard.press('Enter');
        await trash.waitFor({ state: 'detached' });
        await eventually(() => at.evaluate(() => document.activeElement !== document.body), focused);
        assert.deepEqual(other.watch.errors, []);
        await at.close();
    } finally {
        assert.equal(await empty.stop(), 0, empty.log);
    }
});

test('a project that is being opened says so, and is waited for', async () => {
    const slow = await context.newPage();
    let server;
    await slow.routeWebSocket(/./, (socket) => (server = socket)); // this test says what the server does
    await slow.goto(new URL('/?project=aaaaaaaaaaaa', daemon.url).href);
    await eventually(() => server, () => 'no socket');
    const tell = (stage, waited_s) =>
        server.send(JSON.stringify({ jsonrpc: '2.0', method: 'project.opening', params: { project: 'aaaaaaaaaaaa', stage, waited_s } }));
    const banner = slow.locator('.banner');
    await banner.getByText('Opening…').waitFor();
    tell('waiting', 0);
    await banner.getByText('The server opens the project as soon as it has room for it').waitFor();
    tell('opening', 42);
    await banner.getByText('42 s').waitFor();
    await banner.getByRole('status').getByText('The server opens the project', { exact: true }).waitFor();
    await slow.locator('header').getByText('opening').waitFor();
    assert.deepEqual(await violations(slow), []);
    await slow.close();
});
