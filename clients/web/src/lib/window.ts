/** Sums over a sliding window of time, for rates that fall to zero by themselves. */

export class RateWindow {
    private readonly samples: { at: number; amount: number }[] = [];

    constructor(private readonly windowMs: number) {}

    push(at: number, amount: number): void {
        this.samples.push({ at, amount });
    }

    /** Amount per second over the window that ends now. */
    rate(now: number): number {
        while (this.samples.length > 0 && now - this.samples[0]!.at > this.windowMs) this.samples.shift();
        let sum = 0;
        for (const s of this.samples) sum += s.amount;
        return (1000 * sum) / this.windowMs;
    }
}

/** The newest n values, oldest first. */
export class History {
    readonly values: number[] = [];

    constructor(private readonly capacity: number) {}

    push(value: number): void {
        this.values.push(value);
        if (this.values.length > this.capacity) this.values.shift();
    }
}
