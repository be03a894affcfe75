/** Runs a job when calls pause for `pauseMs`; calls that never pause do not put it off for longer than `capMs`. */
export class Debounce {
    private timer: ReturnType<typeof setTimeout> | undefined;
    private firstAt = 0;

    constructor(
        private readonly job: () => void,
        private readonly pauseMs: number,
        private readonly capMs: number,
        private readonly now: () => number = () => performance.now(),
    ) {}

    get pending(): boolean {
        return this.timer !== undefined;
    }

    request(): void {
        const now = this.now();
        if (!this.pending) this.firstAt = now;
        clearTimeout(this.timer);
        const wait = Math.max(0, Math.min(this.pauseMs, this.firstAt + this.capMs - now));
        this.timer = setTimeout(() => {
            this.timer = undefined;
            this.job();
        }, wait);
    }

    cancel(): void {
        clearTimeout(this.timer);
        this.timer = undefined;
    }
}
