// An independent desk: the npm package "sacn" sends universes of 512 channels at 44 Hz. Each frame differs from the one before; the last is
// full everywhere.   node desk_sender.mjs PORT FIRST_UNIVERSE UNIVERSES FRAMES
import { createRequire } from 'node:module';

const { Sender } = createRequire(new URL('../../../clients/web/package.json', import.meta.url))('sacn');
const [port, first, universes, frames] = process.argv.slice(2).map(Number);
const senders = Array.from(
    { length: universes },
    (_, i) =>
        new Sender({
            universe: first + i,
            port,
            useUnicastDestination: '127.0.0.1',
            defaultPacketOptions: { sourceName: 'npm', priority: 120, useRawDmxValues: true },
        }),
);
const start = performance.now();
for (let k = 0; k < frames; k++) {
    const value = k === frames - 1 ? 255 : (k * 5) % 255;
    const payload = Object.fromEntries(Array.from({ length: 512 }, (_, c) => [c + 1, value]));
    await Promise.all(senders.map((s) => s.send({ payload })));
    const wait = start + ((k + 1) * 1000) / 44 - performance.now();
    if (wait > 0) await new Promise((resolve) => setTimeout(resolve, wait));
}
for (const s of senders) s.close();
console.log(`${frames} frames in ${Math.round(performance.now() - start)} ms`);
