// Whether the live page shows the textures of base colours as the CPU does, on a mesh in one material and on one in its own.
// node textured.mjs FOLDER CHROMIUM SPECULA, in the folder of node_modules; FOLDER/textured is the build of textured.toml with the
// meshes of textured.py, and the file of the page and the page that SPECULA serves are both looked at. Of a mesh in its own
// materials, the stills are those of `specula preview --still`. Prints lines as readers.mjs does.

import path from 'path';
import { execFileSync, spawn } from 'child_process';
import { pathToFileURL } from 'url';
import { openBrowser } from './browser.mjs';
import { SIZE, camera, comparedWithPicture, comparedWithStill, resize, show } from './stills.mjs';

const [ folder, chromium, specula ] = process.argv.slice( 2 );
const project = path.resolve( folder, 'textured' );
const said = ( file, text ) => console.log( `textured\t${file}\t${text}` );

/** A still of the mesh in its own materials. */
const dressed = ( mode, material ) => {

	const file = `${project}/${mode}-${material}.png`;
	execFileSync( specula, [ '-C', project, 'preview', '--still', file, '--size', `${SIZE}x${SIZE}`, '--mode', mode, '--item', `environment=sky,material=${material},mesh=dressed` ], { stdio: [ 'ignore', 'ignore', 'inherit' ] } );
	return file;

};

/** The view of such a still. */
const view = { zoom: 0.85 };
const DRESSED = [ [ 'taps', 'paint' ], [ 'cabral', 'metal' ], [ 'irradiance', 'paint' ] ];
const pictures = DRESSED.map( ( of ) => dressed( ...of ) );

const server = spawn( specula, [ '-C', project, 'watch', '--serve' ] );
process.on( 'exit', () => server.kill() );
const link = await new Promise( ( done, fail ) => {

	let text = '';
	server.stderr.on( 'data', ( bytes ) => {

		text += bytes;
		const found = text.match( /http:\/\/\S+/ );
		if ( found ) done( found[ 0 ] );

	} );
	server.on( 'exit', () => fail( new Error( text ) ) );

} );

const { browser, close } = await openBrowser( folder, chromium );
const page = await browser.newPage();
// A page that stands still is a fault that ends, not a wait without end.
setTimeout( () => { said( 'textured.mjs', 'WRONG: not finished after 15 minutes' ); process.exit( 1 ); }, 900000 ).unref();
const problems = [];
page.on( 'pageerror', ( error ) => problems.push( error.message ) );
page.on( 'console', ( message ) => message.type() === 'error' && problems.push( message.text() ) );
await page.setViewport( { width: 480, height: 640 } );
page.setDefaultTimeout( 300000 );

try {

	await page.goto( pathToFileURL( `${project}/out/page.html` ).href, { waitUntil: 'domcontentloaded' } );
	await resize( page, SIZE );
	// The page has fewer degrees of an SHRM than the stills; page.mjs compares it.
	for ( const [ material, mode ] of [ [ 'paint', 'taps' ], [ 'paint', 'cabral' ], [ 'paint', 'kautz-mccool' ], [ 'paint', 'prefiltered' ], [ 'metal', 'taps' ] ] ) {

		await show( page, { environment: 'sky', material, mode, mesh: 'bare', ...camera } );
		said( `bare/${material} ${mode}`, await comparedWithStill( page, `${project}/out/sky/${material}/bare.png`, mode ) );

	}

	for ( const place of [ 'file', 'served' ] ) {

		if ( place === 'served' ) {

			await page.goto( link, { waitUntil: 'domcontentloaded' } );
			await resize( page, SIZE );

		}

		for ( const [ k, [ mode, material ] ] of DRESSED.entries() ) {

			await show( page, { environment: 'sky', material, mode, mesh: 'dressed', ...view } );
			const { mode: shown } = await page.evaluate( () => ( { ...specula.state } ) );
			said( `${place} dressed/${material} ${mode}`, shown === mode ? await comparedWithPicture( page, pictures[ k ] ) : `WRONG: ${shown} is shown` );

		}

	}

	said( 'errors of the page', problems.length ? `WRONG: ${problems[ 0 ]}` : 'none' );

} finally {

	await close();
	server.kill( 'SIGINT' );

}
