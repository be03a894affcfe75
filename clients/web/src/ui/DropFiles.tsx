import { useEffect } from 'preact/hooks';
import type { Named } from '../state/uploads';
import { useApp } from './context';

const named = (file: File): Named => ({ name: file.name, file });

async function below(entry: FileSystemEntry, at = ''): Promise<Named[]> {
    if (entry.isFile) {
        const file = await new Promise<File>((ok, no) => (entry as FileSystemFileEntry).file(ok, no));
        return [{ name: at + entry.name, file }];
    }
    const reader = (entry as FileSystemDirectoryEntry).createReader();
    const found: Named[] = [];
    for (;;) {
        // Some at a time, until there are none.
        const some = await new Promise<FileSystemEntry[]>((ok, no) => reader.readEntries(ok, no));
        if (some.length === 0) return found;
        for (const inside of some) found.push(...(await below(inside, `${at}${entry.name}/`)));
    }
}

async function filesOf(data: DataTransfer): Promise<Named[]> {
    // All at once: later the list is empty.
    const dropped = [...data.items].map((item) => ({ entry: item.webkitGetAsEntry(), file: item.getAsFile() }));
    return (await Promise.all(dropped.map(({ entry, file }) => (entry ? below(entry) : Promise.resolve(file ? [named(file)] : []))))).flat();
}

/** Takes files wherever on the page they are let go. */
export function DropFiles() {
    const { uploads, imports, mayEdit, online } = useApp();
    const takes = uploads.offered.value && mayEdit.value && online.value;
    useEffect(() => {
        const onDrag = (e: DragEvent): void => {
            if (!e.dataTransfer?.types.includes('Files')) return;
            e.preventDefault(); // also where nothing is taken: the browser would leave the page for the file
            uploads.over.value = takes && e.type === 'dragover';
            if (takes && e.type === 'drop') {
                filesOf(e.dataTransfer).then(
                    (files) => uploads.send(files),
                    () => (imports.problem.value = 'The browser cannot read what was dropped.'),
                );
            }
        };
        const kinds = ['dragover', 'dragleave', 'drop'] as const;
        for (const kind of kinds) document.addEventListener(kind, onDrag);
        return () => {
            for (const kind of kinds) document.removeEventListener(kind, onDrag);
        };
    }, [takes]);
    return uploads.over.value ? (
        <div class="drop-here" aria-hidden="true">
            Let go to send it to the server
        </div>
    ) : null;
}

/** The same by a button. */
export function ChooseFiles() {
    const { uploads, imports } = useApp();
    return (
        <label class="choose-files">
            <span>Or send files: drop them onto the page, or choose</span>
            <input
                type="file"
                multiple
                disabled={imports.busy.value}
                onChange={(e) => {
                    const input = e.currentTarget;
                    void uploads.send([...(input.files ?? [])].map(named));
                    input.value = '';
                }}
            />
        </label>
    );
}
