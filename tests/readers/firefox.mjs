// Whether the live page draws in Firefox what the CPU does. node firefox.mjs FOLDER FIREFOX, in the folder of node_modules;
// FOLDER/page is the build of page.toml. Prints lines as readers.mjs does.

import path from 'path';
import { spawn } from 'child_process';
import { pathToFileURL } from 'url';
import { puppeteer } from './browser.mjs';
import { SIZE, camera, comparedWithStill, resize, show } from './stills.mjs';

const [ folder, executablePath ] = process.argv.slice( 2 );
const out = path.resolve( folder, 'page/out' );
const said = ( file, text ) => console.log( `firefox\t${file}\t${text}` );

// Without a screen, Firefox has no WebGL.
const screen = spawn( 'Xvfb', [ '-displayfd', '1', '-screen', '0', '800x800x24' ], { stdio: [ 'ignore', 'pipe', 'ignore' ] } );
const DISPLAY = `:${await new Promise( ( done ) => screen.stdout.once( 'data', ( number ) => done( `${number}`.trim() ) ) )}`;
const browser = await puppeteer().launch( { browser: 'firefox', executablePath, headless: false, protocolTimeout: 600000,
	env: { ...process.env, DISPLAY, LIBGL_ALWAYS_SOFTWARE: '1' }, extraPrefsFirefox: { 'webgl.force-enabled': true } } );
try {

	const page = await browser.newPage();
	const problems = [];
	page.on( 'pageerror', ( error ) => problems.push( error.message ) );
	page.on( 'console', ( message ) => message.type() === 'error' && problems.push( message.text() ) );
	page.setDefaultTimeout( 300000 );
	await page.setViewport( { width: 480, height: 640 } );
	await page.goto( pathToFileURL( `${out}/page.html` ).href, { waitUntil: 'domcontentloaded' } );
	await resize( page, SIZE );
	for ( const mode of [ 'taps', 'irradiance', 'mirror' ] ) {

		await show( page, { environment: 'sky', material: 'copper', mode, mesh: 'torus-knot', ...camera } );
		said( `sky/copper ${mode}`, await comparedWithStill( page, `${out}/sky/copper.png`, mode ) );

	}

	said( 'errors of the page', problems.length ? `WRONG: ${problems[ 0 ]}` : 'none' );

} finally {

	await browser.close();
	screen.kill();

}
