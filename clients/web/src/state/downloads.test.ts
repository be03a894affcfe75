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
