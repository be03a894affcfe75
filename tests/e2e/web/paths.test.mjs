// Three daemons at three paths of one name, behind nginx: the page, its session, files and projects stay at their path, and tokens, too.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { launch, open, settled } from './browser.mjs';
import { certificate } from './certificate.mjs';
import { Daemon } from './daemon.mjs';
import { NGINX, Nginx } from './nginx.mjs';
import { ROOM } from './stage.mjs';

const LAMP = fileURLToPath(new URL('lamp.gltf', import.meta.url));
const TOKENS = ['atrium', 'office', 'stage'].map((name) => `${name}-token-0123456789abcdef0123456789abcdef`);
const made = NGINX && certificate();

if (made) {
    const nginx = new Nginx();
    const daemons = [new Daemon(ROOM, null), new Daemon('furnace', null), new Daemon(null, null, ['--projects', mkdtempSync(join(tmpdir(), 'lumend-e2e-'))])];
    let context;
    let tab;
    let page;
    const sockets = [];
    const address = (path, scheme = 'https') => `${scheme}://localhost:${nginx.port}${path}`;
    /** The tokens that it sent since it was asked last. */
    const sentTokens = () => tab.watch.sent.splice(0).flatMap(({ method, params }) => (method === 'session.hello' ? [params.token] : []));

    before(async () => {
        for (const [i, daemon] of daemons.entries()) {
            writeFileSync(daemon.tokenFile, `${TOKENS[i]}\n`);
            await daemon.start();
        }
        await nginx.start(daemons, made);
        context = await launch();
        context.on('page', (p) => p.on('websocket', (socket) => sockets.push(socket.url())));
        tab = await open(context, address(`/atrium#t=${TOKENS[0]}`)); // who forgot the slash is sent to where it is, with the token
        page = tab.page;
    });
    after(async () => {
        await context?.close();
        await nginx.stop();
        for (const daemon of daemons) if (daemon.child) assert.equal(await daemon.stop(), 0, daemon.log);
    });

    test('a page at a path has its session there, and sends files there', async () => {
        await page.getByLabel('Resolution').selectOption('fast');
        await settled(tab);
        assert.equal(page.url(), address('/atrium/'));
        assert.deepEqual(sockets, [address('/atrium/ws', 'wss')]);
        await page.getByLabel('Or send files').setInputFiles(LAMP);
        await page.locator('.toast', { hasText: 'as lamp' }).waitFor();
    });

    test('a tab has a token for each path, and sends it nowhere else', async () => {
        assert.deepEqual(sentTokens(), [TOKENS[0]]);
        await page.goto(address('/office/'));
        await page.getByLabel('Access token').waitFor();
        assert.deepEqual(sentTokens().filter(Boolean), []);
        await page.goto(address(`/office/?again#t=${TOKENS[1]}`));
        await settled(tab);
        await page.goto(address('/atrium/'));
        await settled(tab);
        assert.deepEqual(sentTokens(), [TOKENS[1], TOKENS[0]]);
    });

    test('projects have their addresses below the path', async () => {
        await page.goto(address(`/stage/#t=${TOKENS[2]}`));
        await page.getByLabel('Name of a new project').fill('Foyer');
        await page.getByLabel('Begin with').selectOption('furnace');
        await page.getByRole('button', { name: 'Create' }).press('Enter');
        await page.waitForURL(/\/stage\/\?project=[a-z0-9]{12}$/);
        await settled(tab);
        await page.reload();
        await settled(tab);
        assert.equal(new URL(sockets.at(-1)).pathname, '/stage/ws');
        assert.deepEqual(tab.watch.errors, []);
    });
} else {
    test('paths', { skip: `${NGINX ? 'openssl' : 'nginx'} is not installed` });
}
