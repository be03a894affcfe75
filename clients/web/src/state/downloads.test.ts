import assert from 'node:assert/strict';
import { test } from 'node:test';
import { signal } from '@preact/signals';
import type { JsonObject } from '../protocol/rpc';
import { Downloads, reportInWords, type DownloadsHost } from './downloads';

test('how far a report is, is told while it is made, and no longer', async () => {
    let refuse: (error: Error) => void = () => undefined;
    const errors: string[] = [];
    const downloads = new Downloads({
        toasts: { info: () => undefined },
        ...{ online: signal(true), viewId: () => 1, onError: (e: Error) => errors.push(e.message) },
        call: () => new Promise<JsonObject>((_, reject) => (refuse = reject)),
    } as unknown as DownloadsHost);
    downloads.notified({ stage: 'picture', done: 1, of: 4 });
    assert.equal(downloads.reportStage.value, '', 'of another');
    const made = downloads.report();
    downloads.notified({ stage: 'picture', done: 1, of: 4 });
    assert.equal(downloads.reportStage.value, 'Picture: 1 of 4 samples');
    refuse(new Error('no'));
    await made;
    assert.deepEqual([downloads.reporting.value, downloads.reportStage.value, errors], [false, '', ['no']]);
    assert.equal(reportInWords({ stage: 'sensors', done: 0, of: 1 }), 'Measuring: 0 of 1 sensor done');
    assert.equal(reportInWords({ stage: 'illuminance', done: 1, of: 2 }), 'Picture of illuminance: 1 of 2 samples');
    assert.equal(reportInWords({ stage: 'of a newer server', done: 1, of: 2 }), '');
});

test('a glTF file is asked for once at a time, and fetched where the server says', async () => {
    const links: { href: string; download: string; clicked: boolean }[] = [];
    const createElement = () => {
        const link = { href: '', download: '', clicked: false, click: () => void (link.clicked = true) };
        links.push(link);
        return link;
    };
    globalThis.document = { createElement } as never;
    let answer: (result: JsonObject) => void = () => undefined;
    let asked = 0;
    const said: string[] = [];
    const downloads = new Downloads({
        toasts: { info: (text: string) => said.push(text) },
        ...{ online: signal(true), viewId: () => 1, onError: (e: Error) => said.push(e.message) },
        call: () => (asked++, new Promise<JsonObject>((resolve) => (answer = resolve))),
    } as unknown as DownloadsHost);
    const first = downloads.model();
    await downloads.model();
    assert.deepEqual([asked, downloads.exporting.value], [1, true]);
    answer({ get: 'download/x', bytes: 5_740_608, scene_rev: 1 });
    await first;
    assert.deepEqual(links.map(({ href, download, clicked }) => [href, download, clicked]), [['download/x', 'scene.glb', true]]);
    assert.equal(downloads.exporting.value, false);
    assert.deepEqual(said, []);
});
