// Whether a served page draws what the CPU does, and follows what happens: a file saved by another program, its own sliders,
// an error of the manifest. node live.mjs FOLDER CHROMIUM SPECULA, in the folder of node_modules; FOLDER/page is the build of
// page.toml, which SPECULA serves. Prints lines as readers.mjs does.

import fs from 'fs';
import path from 'path';
import { spawn } from 'child_process';
import { openBrowser } from './browser.mjs';
import { SIZE, camera, comparedWithStill, resize, show } from './stills.mjs';

const [ folder, chromium, specula ] = process.argv.slice( 2 );
const project = path.resolve( folder, 'page' );
const FEW = 48, PATIENCE = 300000;
const said = ( file, text ) => console.log( `live\t${file}\t${text}` );
const expect = ( what, holds ) => said( what, holds ? 'ok' : 'WRONG' );

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
setTimeout( () => { said( 'live.mjs', 'WRONG: not finished after 10 minutes' ); process.exit( 1 ); }, 600000 ).unref();
const problems = [];
page.on( 'pageerror', ( error ) => problems.push( error.message ) );
page.on( 'console', ( message ) => message.type() === 'error' && problems.push( message.text() ) );
await page.setViewport( { width: 480, height: 640 } );
page.setDefaultTimeout( PATIENCE );
await page.goto( link, { waitUntil: 'domcontentloaded' } );
await resize( page, SIZE );
for ( const mode of [ 'taps', 'prefiltered', 'irradiance' ] ) {

	await show( page, { environment: 'sky', material: 'plastic', mode, mesh: 'torus-knot', ...camera } );
	said( `sky/plastic ${mode}`, await comparedWithStill( page, `${project}/out/sky/plastic.png`, mode ) );

}

// What people and other programs do.
await resize( page, FEW );
const file = `${project}/materials/plastic.toml`;
const text = fs.readFileSync( file, 'utf8' );
const shown = () => page.evaluate( () => specula.scene );
const after = ( scene ) => page.waitForFunction( ( scene ) => specula.scene > scene, {}, scene );
const roughness = ( of ) => Number( of.match( /roughness = (\S+)/ )[ 1 ] );
const ROUGHNESS = '#field-0-2'; // of the model standard: base_color, metallic, roughness
/** The number beside the slider of the roughness. */
const value = () => page.evaluate( ( id ) => document.querySelector( id ).parentElement.querySelector( '[type=number]' ).valueAsNumber, ROUGHNESS );
/** Moves the slider as a hand does. */
const set = ( value ) => page.evaluate( ( id, value ) => {

	const slider = document.querySelector( id );
	slider.value = Number( slider.max ) * ( value - 0.01 ) / 0.99;
	slider.dispatchEvent( new Event( 'input' ) );
	slider.dispatchEvent( new Event( 'change' ) );

}, ROUGHNESS, value );
/** Presses a button when it can be pressed, and waits until it cannot any more. */
const press = async ( id ) => {

	const isDisabled = ( is ) => page.waitForFunction( ( id, is ) => document.getElementById( id ).disabled === is, {}, id, is );
	await isDisabled( false );
	await page.evaluate( ( id ) => document.getElementById( id ).click(), id );
	await isDisabled( true );

};


try {

	let scene = await shown();
	fs.writeFileSync( file, text.replace( /roughness = \S+/, 'roughness = 0.3' ) );
	await after( scene );
	expect( 'a material saved by another program appears', await value() === 0.3 );

	scene = await shown();
	const start = Date.now();
	await set( 0.5 );
	await after( scene );
	said( 'a slider is followed', `ok, drawn after ${Date.now() - start} ms` );
	expect( 'and writes nothing', roughness( fs.readFileSync( file, 'utf8' ) ) === 0.3 );
	await press( 'undo' );
	expect( 'undo takes it back', await value() === 0.3 );
	await set( 0.45 );
	await press( 'save' );
	expect( 'what is saved is in the file', roughness( fs.readFileSync( file, 'utf8' ) ) === 0.45 );

	const manifest = fs.readFileSync( `${project}/pipeline.toml`, 'utf8' );
	const problem = ( holds ) => page.waitForFunction( ( holds ) => document.getElementById( 'problem' ).textContent.includes( 'pipeline.toml has errors' ) === holds, {}, holds );
	fs.writeFileSync( `${project}/pipeline.toml`, manifest.replace( 'degree = [12, 4]', 'degree = [-12, 4]' ) );
	await problem( true );
	fs.writeFileSync( `${project}/pipeline.toml`, manifest );
	await problem( false );
	expect( 'an error of the manifest is shown until it is mended', true );

	await page.evaluate( () => { location.hash = 'material=copper&environment=sky&mesh=sphere&mode=mirror'; } );
	await page.waitForFunction( () => specula.state.material === 'copper' && ! document.getElementById( 'canvas' ).getAttribute( 'aria-busy' ) );
	expect( 'a link shows another material', await page.evaluate( () => specula.state.mode ) === 'mirror' );
	const other = await browser.newPage();
	other.setDefaultTimeout( PATIENCE );
	await other.goto( `${link}#material=plastic&environment=sky&mesh=sphere`, { waitUntil: 'domcontentloaded' } );
	await resize( other, FEW );
	// A page in the background draws nothing.
	const shows = async ( of, material ) => {

		await of.bringToFront();
		await of.waitForFunction( ( material ) => specula.state.material === material && specula.drawn > 0 && ! document.getElementById( 'canvas' ).getAttribute( 'aria-busy' ), {}, material );

	};
	await shows( page, 'plastic' );
	expect( 'a page follows another, in its own form', await page.evaluate( () => specula.state.mode ) === 'mirror' );
	await page.evaluate( () => { location.hash = 'material=copper&environment=sky&mesh=sphere&mode=mirror'; } );
	await shows( other, 'copper' );
	expect( 'and that one follows back', await other.evaluate( () => specula.state.mode ) !== 'mirror' );
	await other.goto( 'about:blank' );
	await other.goto( link, { waitUntil: 'domcontentloaded' } );
	await resize( other, FEW );
	await shows( other, 'copper' );
	expect( 'the bare link shows what is shown', await page.evaluate( () => specula.state.material ) === 'copper' );
	await other.close();
	said( 'errors of the page', problems.length ? `WRONG: ${problems[ 0 ]}` : 'none' );

} finally {

	fs.writeFileSync( file, text );
	await close();
	server.kill( 'SIGINT' );

}
