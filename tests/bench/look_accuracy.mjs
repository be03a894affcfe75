// LUMEND=build/release/bin/lumend node tests/bench/look_accuracy.mjs OUT [SCENE]: what the panel "Accuracy" and its picture
// show half a second, 4 s and 20 s after the eye was moved: OUT/look-0.5.jpg, OUT/look-4.jpg, OUT/look-20.jpg.
import { join } from 'node:path';
import { launch, open, settled } from '../e2e/web/browser.mjs';
import { Daemon } from '../e2e/web/daemon.mjs';

const [out, scene = 'cornell'] = process.argv.slice(2);
if (!out || !process.env.LUMEND) {
    console.error('usage: LUMEND=PATH-OF-LUMEND node look_accuracy.mjs OUT [SCENE]');
    process.exit(2);
}
const WAITS_S = [0.5, 4, 20];
const SIZE = { width: 900, height: 560 };

const daemon = new Daemon(scene, null);
const context = await launch(1);
try {
    const tab = await open(context, await daemon.start());
    const { page } = tab;
    await page.setViewportSize(SIZE);
    await settled(tab);
    const panel = page.getByRole('region', { name: 'Accuracy' });
    await panel.getByLabel('Stop refining at').press('End');
    await panel.evaluate((node) => node.scrollIntoView({ block: 'start' }));
    await page.locator('.stage').press('ArrowLeft');
    const begin = performance.now();
    for (const wait of WAITS_S) {
        await new Promise((done) => setTimeout(done, Math.max(0, begin + 1e3 * wait - performance.now())));
        await page.screenshot({ path: join(out, `look-${wait}.jpg`), type: 'jpeg', quality: 80 });
        const { ms, spent_ms, spp, error } = tab.watch.stats.at(-1);
        console.log(JSON.stringify({ wait, late_ms: Math.round(performance.now() - begin - 1e3 * wait), spp, ms, spent_ms, error }));
    }
} finally {
    await context.close();
    await daemon.stop();
}
