// A first picture: node examples/first_picture.js 'http://127.0.0.1:9460/#t=TOKEN' room.png
import { writeFile } from 'node:fs/promises';
import { connect } from 'lumend';

const [url, path] = process.argv.slice(2);
if (!path) throw new Error("usage: node examples/first_picture.js 'URL' PICTURE.png");

const session = await connect(url, { client: 'first-picture' });
const view = await session.view(600, 400, { spp: 4 });
const picture = await view.picture(); // waits until it is final
await writeFile(path, await picture.png());
const { value, unit } = await view.read(300, 200);
console.log(`${path}: revision ${picture.sceneRev} of the scene, ${picture.stats.spp} samples per pixel, ${value?.toFixed(1)} ${unit} in the middle`);
await session.close();
