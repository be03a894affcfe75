// A daemon of our own on a port of its choice, with a token that survives a restart.
import { spawn } from 'node:child_process';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { createInterface } from 'node:readline';

const TOKEN = 'e2e-token-0123456789abcdef0123456789abcdef';

export class Daemon {
    /** scene: null where the options say what is served. assets: the folder for imports; null: none. */
    constructor(scene, assets = scene && dirname(scene), options = []) {
        this.folder = mkdtempSync(join(tmpdir(), 'lumend-e2e-'));
        this.tokenFile = join(this.folder, 'token');
        writeFileSync(this.tokenFile, `${TOKEN}\n`, { mode: 0o600 });
        this.scene = scene;
        this.assets = assets;
        this.options = options;
        this.port = 0;
        this.log = '';
    }

    /** Resolves with the URL that the daemon prints when it is ready. */
    async start() {
        const args = [...(this.scene ? ['--scene', this.scene] : []), '--listen', `127.0.0.1:${this.port}`, '--token-file', this.tokenFile];
        args.push(...this.options);
        if (this.assets) args.push('--assets', this.assets);
        this.child = spawn(process.env.LUMEND, args, { stdio: ['ignore', 'pipe', 'pipe'] });
        this.child.stderr.on('data', (chunk) => (this.log += chunk));
        this.exited = new Promise((resolve) => this.child.on('exit', (code, signal) => resolve({ code, signal })));
        const ready = new Promise((resolve, reject) => {
            createInterface(this.child.stdout).on('line', (line) => {
                const match = /^lumend ready (https?:\/\/.*)$/.exec(line);
                if (match) resolve(match[1]);
                else reject(new Error(`stdout of the daemon: ${line}`));
            });
            void this.exited.then((e) => reject(new Error(`the daemon ended: ${JSON.stringify(e)}\n${this.log}`)));
        });
        this.url = await ready;
        this.port = Number(new URL(this.url).port);
        return this.url;
    }

    /** SIGTERM; resolves with the exit status. */
    async stop() {
        this.child.kill('SIGTERM');
        return (await this.exited).code;
    }
}
