/** For tests: timers that run when told to. (Those of node's test runner are called otherwise in each of its versions.) */
const NAMES = ['setTimeout', 'clearTimeout', 'setInterval', 'clearInterval'] as const;

export class FakeTimers {
    now = 0;
    private next = 1;
    private readonly due = new Map<number, { at: number; every: number | null; job: () => void }>();
    private readonly real = NAMES.map((name) => [name, globalThis[name]] as const);

    constructor() {
        const add = (job: () => void, ms: number, every: number | null): number => {
            this.due.set(this.next, { at: this.now + ms, every, job });
            return this.next++;
        };
        const drop = (id?: number): void => void (id !== undefined && this.due.delete(id));
        Object.assign(globalThis, {
            setTimeout: (job: () => void, ms = 0) => add(job, ms, null),
            setInterval: (job: () => void, ms = 0) => add(job, ms, ms),
            clearTimeout: drop,
            clearInterval: drop,
        });
    }

    tick(ms: number): void {
        const end = this.now + ms;
        for (;;) {
            const [id, timer] = [...this.due].filter(([, t]) => t.at <= end).sort(([, a], [, b]) => a.at - b.at)[0] ?? [];
            if (id === undefined || !timer) break;
            this.now = timer.at;
            if (timer.every === null) this.due.delete(id);
            else timer.at += timer.every;
            timer.job();
        }
        this.now = end;
    }

    reset(): void {
        Object.assign(globalThis, Object.fromEntries(this.real));
    }
}
