/** Links to what this page shows: made for others, and opened when this page is called by one. */
import { signal } from '@preact/signals';
import type { CameraPose } from '../protocol/types';
import { fragmentOf, isShared, linkTo, sharedIn, type Known, type SharedSettings } from './share';

export interface SharingHost {
    pose(): CameraPose;
    settings(): SharedSettings;
    /** Of the project that is shown; "": the one scene there is. */
    project(): string;
    known(): Known;
    show(pose: CameraPose | null, settings: Partial<SharedSettings>): void;
    /** What of the link is no good. */
    onRefused(text: string): void;
    announce(text: string): void;
    /** In place of the browser's, for tests. */
    page?: { hash: string; origin: string; pathname: string; forget(): void; write(text: string): Promise<void> };
}

export class Sharing {
    /** To be copied by hand: this page may not write to the clipboard. null: there is nothing to copy. */
    readonly byHand = signal<string | null>(null);
    private wanted: string | null = null;
    private readonly page;

    constructor(private readonly host: SharingHost) {
        this.page = host.page ?? {
            ...{ hash: location.hash, origin: location.origin, pathname: location.pathname },
            forget: () => history.replaceState(null, '', location.pathname + location.search),
            // Absent where the page did not come over TLS, or from this machine.
            write: async (text: string) => navigator.clipboard.writeText(text),
        };
        this.called(this.page.hash);
    }

    /** The page was called by an address that ends in this. True: it shows a view, once it is known what the server has. */
    called(hash: string): boolean {
        if (isShared(hash)) this.wanted = hash;
        return this.waits;
    }

    get waits(): boolean {
        return this.wanted !== null;
    }

    /** Shows what the page was called for. True: a camera was in it. The address says so no more: the user goes on from there. */
    apply(): boolean {
        const shared = this.wanted === null ? null : sharedIn(this.wanted, this.host.known());
        this.wanted = null;
        if (!shared) return false;
        this.page.forget();
        this.host.show(shared.pose, shared.settings);
        if (shared.refused.length > 0) this.host.onRefused(shared.refused.join('. '));
        return shared.pose !== null;
    }

    link(): string {
        return linkTo(this.page, this.host.project(), fragmentOf(this.host.pose(), this.host.settings()));
    }

    async copy(): Promise<void> {
        const link = this.link();
        try {
            await this.page.write(link);
            this.byHand.value = null;
            this.host.announce('The link is copied');
        } catch {
            this.byHand.value = link;
            this.host.announce('This browser lets no page copy here: the link is in a field, selected');
        }
    }
}
