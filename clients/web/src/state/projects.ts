/** Scenes of a server that has many: which there are, which one this page shows, and what is done with them. */
import { computed, signal } from '@preact/signals';
import { isObject, type Json, type JsonObject } from '../protocol/rpc';
import { numberOr, stringOr } from '../protocol/types';
import { personOf } from './comeback';

export const MOST_NAME_BYTES = 120;

export interface Project {
    id: string;
    name: string;
    changedS: number;
    people: readonly string[];
}
export interface Trashed {
    id: string;
    name: string;
    deletedS: number;
}
export interface Version {
    id: string;
    name: string;
    keptS: number;
}

const objects = (list: Json | undefined): JsonObject[] => (Array.isArray(list) ? list.filter(isObject) : []);
const texts = (list: Json | undefined): string[] => (Array.isArray(list) ? list.filter((t) => typeof t === 'string') : []);

/** Changed last comes first. */
export function projectsIn(answer: JsonObject): Project[] {
    const all = objects(answer.projects).map((p) => ({
        ...{ id: stringOr(p.id, ''), name: stringOr(p.name, ''), changedS: numberOr(p.changed_s, 0) },
        people: texts(p.people),
    }));
    return all.sort((a, b) => b.changedS - a.changedS || a.name.localeCompare(b.name));
}

/** As long as the server takes it: the first characters of it. */
export function shortened(name: string, bytes = MOST_NAME_BYTES): string {
    const encoder = new TextEncoder();
    let short = name;
    while (encoder.encode(short).length > bytes) short = Array.from(short).slice(0, -1).join('');
    return short.trimEnd();
}

/** "Foyer, copy", "Foyer, copy 2": one that nobody has. */
export function nameOfCopy(name: string, taken: ReadonlySet<string>): string {
    for (let n = 1; ; n++) {
        const end = n === 1 ? ', copy' : `, copy ${n}`;
        const copy = shortened(name, MOST_NAME_BYTES - end.length) + end;
        if (!taken.has(copy)) return copy;
    }
}

/** What browsers call themselves whose token is nobody's in particular. */
const NOBODY = 'lumend-web';

/** For people: how many are in it, and those who have a name. isHere: this page is one of them. */
export function peopleIn({ people }: Project, isHere: boolean): string {
    const others = people.length - (isHere ? 1 : 0);
    const names = [...new Set(people.map(personOf))].filter((name) => name !== NOBODY);
    const named = names.length > 0 ? `: ${names.join(', ')}` : '';
    if (isHere) return others === 0 ? 'open here' : `open here, and by ${others} more${named}`;
    return people.length === 0 ? '' : `${people.length === 1 ? 'somebody' : people.length} in it${named}`;
}

export interface ProjectsHost {
    call: (method: string, params: JsonObject) => Promise<JsonObject>;
    onError: (error: Error) => void;
    announce(text: string): void;
    goTo(id: string): void;
}

export class Projects {
    /** The server has many scenes. */
    readonly many = signal(false);
    /** Whose scene this page shows; null: none, or the one there is. */
    readonly here = signal<{ id: string; name: string } | null>(null);
    readonly list = signal<readonly Project[]>([]);
    readonly trash = signal<readonly Trashed[]>([]);
    /** Built in: what a new one can begin with. */
    readonly scenes = signal<readonly string[]>([]);
    /** Of those that were asked for. */
    readonly versions = signal<ReadonlyMap<string, readonly Version[]>>(new Map());
    /** Over the scene. */
    readonly dialog = signal(false);
    /** Just deleted: it can be taken back at once. */
    readonly gone = signal<Trashed | null>(null);
    /** Why the scene that was wanted is not shown. */
    readonly problem = signal('');
    /** A copy is being written, and the like. */
    readonly busy = signal(false);
    readonly atStart = computed(() => this.many.value && this.here.value === null);
    readonly shown = computed(() => this.atStart.value || this.dialog.value);

    constructor(private readonly host: ProjectsHost) {}

    /** The answer to hello. True: there is no scene to show. */
    online(hello: JsonObject): boolean {
        const { project } = hello;
        this.many.value = hello.projects === true;
        this.here.value = isObject(project) ? { id: stringOr(project.id, ''), name: stringOr(project.name, '') } : null;
        document.title = this.here.value ? `${this.here.value.name} – lumend` : 'lumend';
        if (this.shown.value) void this.refresh();
        return this.atStart.value;
    }

    open(): void {
        this.dialog.value = true;
        void this.refresh();
    }

    async refresh(): Promise<void> {
        const answer = await this.host.call('project.list', {}).catch(() => null);
        if (!answer) return;
        this.list.value = projectsIn(answer);
        this.renamed();
        this.trash.value = objects(answer.trash).map((p) => ({ id: stringOr(p.id, ''), name: stringOr(p.name, ''), deletedS: numberOr(p.deleted_s, 0) }));
        this.scenes.value = texts(answer.scenes);
    }

    /** By whomever. */
    private renamed(): void {
        const now = this.list.value.find((p) => p.id === this.here.value?.id);
        if (!now || now.name === this.here.value?.name) return;
        this.here.value = { id: now.id, name: now.name };
        document.title = `${now.name} – lumend`;
    }

    async create(name: string, scene: string): Promise<void> {
        await this.begin({ name, ...(scene && { scene }) });
    }

    /** And goes on in it. */
    async saveAs(name: string, from: string, version = ''): Promise<void> {
        await this.begin({ name, from, ...(version && { version }) });
    }

    async duplicate(project: Project): Promise<void> {
        const name = nameOfCopy(project.name, new Set(this.list.value.map((p) => p.name)));
        if (await this.ask('project.create', { name, from: project.id })) this.host.announce(`${name} is made`);
    }

    async rename(project: Project, name: string): Promise<void> {
        if (name === '' || name === project.name) return;
        await this.ask('project.rename', { project: project.id, name: shortened(name) });
    }

    async remove({ id, name }: Project): Promise<void> {
        if (!(await this.ask('project.delete', { project: id }))) return;
        this.gone.value = this.trash.value.find((t) => t.id === id) ?? null;
        this.host.announce(`${name} is in the trash`);
    }

    async restore({ id, name }: Trashed): Promise<void> {
        this.gone.value = null;
        if (await this.ask('project.restore', { project: id })) this.host.announce(`${name} is back`);
    }

    /** Out of the trash: nothing brings it back. */
    async erase({ id, name }: Trashed): Promise<void> {
        if (this.gone.value?.id === id) this.gone.value = null;
        if (await this.ask('project.erase', { project: id })) this.host.announce(`${name} is deleted for ever`);
    }

    async emptyTrash(): Promise<void> {
        this.gone.value = null;
        if (await this.ask('trash.empty', {})) this.host.announce('The trash is empty');
    }

    async loadVersions(id: string): Promise<void> {
        const answer = await this.host.call('version.list', { project: id }).catch((error: unknown) => this.failed(error as Error));
        const list = objects(answer?.versions).map((v) => ({ id: stringOr(v.version, ''), name: stringOr(v.name, ''), keptS: numberOr(v.kept_s, 0) }));
        this.versions.value = new Map(this.versions.value).set(id, list.sort((a, b) => b.keptS - a.keptS));
    }

    async keep(id: string, name: string): Promise<boolean> {
        const done = await this.ask('version.keep', { project: id, name: shortened(name) });
        if (done) this.host.announce(`${name} is kept as a version`);
        await this.loadVersions(id);
        return done !== null;
    }

    async forget(id: string, version: Version): Promise<void> {
        await this.ask('version.remove', { project: id, version: version.id });
        await this.loadVersions(id);
    }

    private async begin(params: JsonObject): Promise<void> {
        const made = await this.ask('project.create', { ...params, name: shortened(stringOr(params.name, '')) });
        if (made) this.host.goTo(stringOr(made.project, ''));
    }

    /** What the server answers, with the list as it is then; null: it refused, which was said. */
    private async ask(method: string, params: JsonObject): Promise<JsonObject | null> {
        this.busy.value = true;
        const answer = await this.host.call(method, params).catch((error: unknown) => this.failed(error as Error));
        await this.refresh();
        this.busy.value = false;
        return answer;
    }

    private failed(error: Error): null {
        this.host.onError(error);
        return null;
    }
}

/** ?project= of the address. */
export const projectInAddress = (): string => new URLSearchParams(location.search).get('project') ?? '';

export const hrefOf = (id: string): string => `?project=${encodeURIComponent(id)}`;
