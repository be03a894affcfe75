// node run.mjs build/release/bin/lumend [name pattern]: the browser tests. Exit status 77: skipped, and why.
import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { CHROMIUM } from './browser.mjs';

const [lumend, pattern] = process.argv.slice(2);
if (!lumend) {
    console.error('usage: node run.mjs PATH-OF-LUMEND [NAME-PATTERN]');
    process.exit(2);
}
if (!existsSync(CHROMIUM)) {
    console.log(`skipped: no ${CHROMIUM}`);
    process.exit(77);
}
const tests = fileURLToPath(new URL('client.test.mjs', import.meta.url));
const only = pattern ? [`--test-name-pattern=${pattern}`] : [];
const run = spawnSync(process.execPath, ['--test', ...only, tests], { stdio: 'inherit', env: { ...process.env, LUMEND: lumend } });
process.exit(run.status ?? 1);
