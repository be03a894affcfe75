/** A job that takes time, once at a time: however often it is asked for while it runs, it runs once more after that. */
export class Once {
    private running: Promise<void> | null = null;
    private next: Promise<void> | null = null;

    constructor(private readonly job: () => Promise<void>) {}

    /** Resolves when a run that began after this call, or now, is over. */
    run(): Promise<void> {
        if (!this.running) {
            this.running = this.job().finally(() => (this.running = null));
            return this.running;
        }
        const after = (): Promise<void> => {
            this.next = null;
            return this.run();
        };
        this.next ??= this.running.then(after, after);
        return this.next;
    }
}
