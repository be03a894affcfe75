/** Runs a job at most once per animation frame, and not above 60 times a second on faster screens. */

/** The server takes 240 messages a second from a session; a camera and an edit stream share that. */
const MIN_INTERVAL_MS = 15;
/** A hidden tab has no animation frames, and what was changed last must not wait until somebody looks. */
const LATEST_MS = 250;

export class Pacer {
    private scheduled = false;
    private last = -Infinity;

    constructor(private readonly job: () => void) {}

    request(): void {
        if (this.scheduled) return;
        this.scheduled = true;
        requestAnimationFrame((now) => this.tick(now));
        setTimeout(() => this.tick(performance.now()), LATEST_MS);
    }

    private tick(now: number): void {
        if (!this.scheduled) return;
        this.scheduled = false;
        if (now - this.last < MIN_INTERVAL_MS) {
            this.request();
            return;
        }
        this.last = now;
        this.job();
    }
}
