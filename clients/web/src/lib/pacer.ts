/** Runs a job at most once per animation frame, and not above 60 times a second on faster screens. */

/** The server takes 240 messages a second from a session; a camera and an edit stream share that. */
const MIN_INTERVAL_MS = 15;

export class Pacer {
    private scheduled = false;
    private last = -Infinity;

    constructor(private readonly job: () => void) {}

    request(): void {
        if (this.scheduled) return;
        this.scheduled = true;
        // A hidden tab has no animation frames, and what was changed last must not wait until somebody looks.
        if (document.hidden) setTimeout(() => this.tick(performance.now()), MIN_INTERVAL_MS);
        else requestAnimationFrame((now) => this.tick(now));
    }

    private tick(now: number): void {
        this.scheduled = false;
        if (now - this.last < MIN_INTERVAL_MS) {
            this.request();
            return;
        }
        this.last = now;
        this.job();
    }
}
