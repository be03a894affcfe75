// The page by https, its session by wss, and a file that is sent from it. Scene: room.jsonl.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { certificate } from './certificate.mjs';
import { edit, page, ROOM, serve, tab } from './stage.mjs';

const LAMP = fileURLToPath(new URL('lamp.gltf', import.meta.url));
const made = certificate();
if (made) {
    const daemon = serve(ROOM, null, made.options);

    test('the page shows its picture, and takes a file', async () => {
        assert.match(daemon.url, /^https:\/\/localhost:\d+\/#t=/);
        assert.equal(new URL(page.url()).protocol, 'https:');
        assert.ok(tab.watch.sent.some(({ method }) => method === 'session.hello'));
        await edit(() => page.getByLabel('Or send files').setInputFiles({ name: 'lamp.gltf', mimeType: 'model/gltf+json', buffer: readFileSync(LAMP) }));
        await page.locator('.toast', { hasText: 'as lamp' }).waitFor();
        assert.deepEqual(tab.watch.errors, []);
    });
} else {
    test('TLS', { skip: 'openssl is not installed' });
}
