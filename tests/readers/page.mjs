// Whether the live page draws what the CPU does, from its file, in a browser with software for a graphics device.
// node page.mjs FOLDER CHROMIUM, in the folder of node_modules; FOLDER/page is the build of page.toml. Each form of each
// material is compared with its still, without the pixels at edges, where one sample of a pixel decides: 99 % of the others
// within 3 of 255. What measured the stops is read. Then drags, keys, a link and the difference of a form from itself.
// Prints lines as readers.mjs does.

import fs from 'fs';
import path from 'path';
import { pathToFileURL } from 'url';
import { openBrowser } from './browser.mjs';
import { MODES, SIZE, camera, codesOfCanvas, comparedWithPicture, comparedWithStill, resize, show } from './stills.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const out = path.resolve( folder, 'page/out' );
const FEW = 48, PATIENCE = 300000;
const said = ( file, text ) => console.log( `page\t${file}\t${text}` );

const { browser, close } = await openBrowser( folder, chromium );
const page = await browser.newPage();
// A page that stands still is a fault that ends, not a wait without end.
setTimeout( () => { said( 'page.mjs', 'WRONG: not finished after 15 minutes' ); process.exit( 1 ); }, 900000 ).unref();
const problems = [];
page.on( 'pageerror', ( error ) => problems.push( error.message ) );
page.on( 'console', ( message ) => message.type() === 'error' && problems.push( message.text() ) );
await page.setViewport( { width: 480, height: 640 } );
// On a machine that does other things, software takes long for a shader.
page.setDefaultTimeout( PATIENCE );

/** Opens a page whose picture has so many pixels along an edge: few, since they are drawn by software. */
async function open( file, size, fragment = '' ) {

	await page.goto( 'about:blank' );
	await page.goto( pathToFileURL( `${out}/${file}.html` ).href + fragment, { waitUntil: 'domcontentloaded' } );
	await resize( page, size );

}

const stills = fs.readdirSync( out, { withFileTypes: true } ).filter( ( entry ) => entry.isDirectory() && entry.name !== 'matte' ).flatMap(
	( { name } ) => fs.readdirSync( `${out}/${name}` ).filter( ( file ) => file.endsWith( '.png' ) ).map( ( file ) => [ name, file.slice( 0, - 4 ) ] ) );
if ( ! stills.length ) said( 'stills', 'WRONG: there are none' );

for ( const file of [ 'page', 'shrm' ] ) {

	await open( file, SIZE );
	said( `${file}.html, ${Math.round( fs.statSync( `${out}/${file}.html` ).size / 1000 )} kB`,
		`first picture after ${await page.evaluate( () => document.documentElement.dataset.firstPicture )} ms` );
	for ( const [ environment, material ] of stills ) for ( const mode of MODES ) {

		if ( ( file === 'shrm' ) !== ( mode === 'local-shrm' ) ) continue;
		await show( page, { environment, material, mode, mesh: 'torus-knot', ...camera } );
		const state = await page.evaluate( () => ( { ...specula.state } ) );
		if ( state.mode !== mode || state.material !== material ) { said( `${environment}/${material} ${mode}`, 'WRONG: is not on the page' ); continue; }

		said( `${environment}/${material} ${mode}`, await comparedWithStill( page, `${out}/${environment}/${material}.png`, mode ) );

	}

	// The page shrm has a report, and the other one measures.
	await show( page, { mode: file === 'shrm' ? 'local-shrm' : 'taps' } );
	const text = await page.evaluate( () => document.getElementById( 'forms' ).textContent );
	const measured = file === 'shrm' ? 'over all views, as the report measured' : 'in one view of a sphere, as this page measured';
	said( `${file}.html, stops`, text.includes( measured ) ? 'ok' : `WRONG: ${text}` );

}

// Between vertices the page interpolates the radiance, and the still the light that arrives.
const BETWEEN_VERTICES = 5;
await open( 'page', SIZE );
await show( page, { environment: 'sky', mode: 'transfer', mesh: 'knot', ...camera } );
if ( await page.evaluate( () => specula.state.mode ) !== 'transfer' ) said( 'sky/matte transfer', 'WRONG: is not on the page' );
else said( 'sky/matte transfer', await comparedWithPicture( page, `${out}/matte/sky.png`, [ 0, 0 ], BETWEEN_VERTICES ) );
await show( page, { environment: 'sky', mode: 'transfer', mesh: 'sphere', ...camera } );
said( 'a mesh without a transfer', await page.evaluate( () => specula.state.mode ) === 'transfer' ? 'WRONG: shows one' : 'ok' );

// What people do.
await open( 'page', FEW );
const stateOf = () => page.evaluate( () => ( { ...specula.state } ) );
const drawnOnce = async ( act ) => {

	const before = await page.evaluate( () => specula.drawn );
	await act();
	await page.waitForFunction( ( before ) => specula.drawn > before, {}, before );
	return stateOf();

};
const expect = ( what, holds ) => said( what, holds ? 'ok' : 'WRONG' );
const box = await ( await page.$( '#canvas' ) ).boundingBox();
const middle = [ box.x + box.width / 2, box.y + box.height / 2 ];
const start = await stateOf();
const dragged = async ( shift ) => drawnOnce( async () => {

	if ( shift ) await page.keyboard.down( 'Shift' );
	await page.mouse.move( ...middle );
	await page.mouse.down();
	await page.mouse.move( middle[ 0 ] + 80, middle[ 1 ] + 10, { steps: 4 } );
	await page.mouse.up();
	if ( shift ) await page.keyboard.up( 'Shift' );

} );
const orbited = await dragged( false );
expect( 'a drag turns the camera', orbited.yaw !== start.yaw && orbited.turn === start.turn );
const turned = await dragged( true );
expect( 'a drag with shift turns the light', turned.turn !== orbited.turn && turned.yaw === orbited.yaw );
await page.mouse.move( ...middle ); // the drags have left the picture
const zoomed = await drawnOnce( () => page.mouse.wheel( { deltaY: - 240 } ) );
expect( 'the wheel zooms', zoomed.zoom > turned.zoom );
const devtools = await page.createCDPSession();
/** Moves fingers on the picture: each from a place and by a way, in shares of the picture's edge about its middle. */
const touched = ( ...fingers ) => drawnOnce( async () => {

	const touch = ( type, touchPoints ) => devtools.send( 'Input.dispatchTouchEvent', { type, touchPoints } );
	const at = ( part ) => fingers.map( ( [ from, way ], id ) => (
		{ id, x: middle[ 0 ] + ( from[ 0 ] + part * way[ 0 ] ) * box.width, y: middle[ 1 ] + ( from[ 1 ] + part * way[ 1 ] ) * box.height } ) );
	await touch( 'touchStart', at( 0 ) );
	for ( let step = 1; step <= 5; step ++ ) {

		await touch( 'touchMove', at( step / 5 ) );
		await page.evaluate( () => new Promise( requestAnimationFrame ) );

	}

	await touch( 'touchEnd', [] );

} );
await show( page, { zoom: 1 } );
const untouched = await stateOf();
const fingered = await touched( [ [ - 0.2, 0 ], [ 0.4, 0 ] ] );
expect( 'a finger turns the camera', fingered.yaw !== untouched.yaw && fingered.turn === untouched.turn && fingered.zoom === 1 );
const pinched = await touched( [ [ - 0.1, 0 ], [ - 0.3, 0 ] ], [ [ 0.1, 0 ], [ 0.3, 0 ] ] );
expect( 'a pinch zooms and turns nothing', pinched.zoom > 1 && pinched.yaw === fingered.yaw && pinched.turn === fingered.turn );
const pair = await touched( [ [ - 0.3, 0 ], [ 0.4, 0 ] ], [ [ - 0.1, 0 ], [ 0.4, 0 ] ] );
expect( 'two fingers turn the light', pair.turn !== pinched.turn && pair.yaw === pinched.yaw && pair.zoom === pinched.zoom );
await page.focus( '#canvas' );
const next = await drawnOnce( () => page.keyboard.press( ']' ) );
expect( 'a key takes the next material', next.material !== pair.material );
await page.waitForFunction( () => location.hash.includes( 'turn=' ) );
const link = await page.evaluate( () => location.hash );
await open( 'page', FEW, link );
const linked = await stateOf();
expect( 'a link shows the same view', JSON.stringify( linked ) === JSON.stringify( next ) || [ 'yaw', 'pitch', 'turn', 'tilt', 'zoom' ].every( ( key ) => Math.abs( linked[ key ] - next[ key ] ) < 1e-3 ) && linked.material === next.material );
const typed = await page.evaluate( () => {

	set( { zoom: 1.5 } );
	location.hash = 'mode=mirror&zoom=2';
	writeAddress(); // as its timer does, before the event of the other address
	return { ...specula.state };

} );
expect( 'an address that is typed after a change is not lost', typed.mode === 'mirror' && typed.zoom === 2 );
await show( page, { mode: 'taps', compare: 'mirror', show: 'difference', amplify: 8 } );
const difference = await page.evaluate( codesOfCanvas );
expect( 'a difference is drawn', new Set( difference ).size > 20 );
const heap = async () => { await page.evaluate( () => globalThis.gc?.() ); return ( await page.metrics() ).JSHeapUsedSize / 1e6; };
const switched = ( count ) => page.evaluate( async ( count ) => {

	for ( let k = 0; k < count; k ++ ) {

		// Not by the address, which the page may write at the same moment.
		const before = specula.drawn;
		set( readFragment( `mode=${[ 'mirror', 'irradiance', 'cabral' ][ k % 3 ]}` ) );
		while ( specula.drawn === before ) await new Promise( requestAnimationFrame );

	}

}, count );
await switched( 9 );
const before = await heap();
await switched( 200 );
const grown = await heap() - before;
said( 'memory after 200 switches', `${grown.toFixed( 1 )} MB more${grown > 20 ? ' WRONG' : ''}` );
said( 'errors of the page', problems.length ? `WRONG: ${problems[ 0 ]}` : 'none' );
await close();
