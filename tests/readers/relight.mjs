// Whether meshes that the code of docs/relighting.md lights in three.js have the radiance of `shade-vertices`, vertex by vertex.
// node relight.mjs FOLDER CHROMIUM DOCUMENT, in the folder of node_modules; FOLDER/out has what relight.toml makes. Prints lines
// as readers.mjs does: the largest error, in shares of the brightest vertex. A screenshot of the meshes goes into FOLDER.

import fs from 'fs';
import { openBrowser } from './browser.mjs';

const [ folder, chromium, document ] = process.argv.slice( 2 );
const MOST = 1e-3;

// Blocks of JavaScript: files, which begin with their names, and lines that use them.
const blocks = fs.readFileSync( document, 'utf8' ).split( '```js\n' ).slice( 1 ).map( ( rest ) => rest.split( '```' )[ 0 ] );
for ( const block of blocks ) {

	const name = block.match( /^\/\/ (\w+\.js)\n/ )?.[ 1 ];
	if ( name ) fs.writeFileSync( `${folder}/${name}`, block );

}

const glossy = blocks.find( ( block ) => block.includes( "from './glossy.js'" ) );

const near = { at: [ 0, 1, 4 ] }, far = { from: [ - 0.5, 0.7, 1 ] };
const list = ( at ) => fs.readdirSync( `${folder}/out/${at}` );
const pairs = ( form, view ) => list( form ).flatMap( ( mesh ) => list( `${form}/${mesh}` ).map( ( material ) => {

	const name = `${form}/${mesh}/${material}`;
	return { name, code: glossy, files: [ name, material ], view };

} ) );
const cases = [
	...list( 'matte' ).map( ( file ) => ( { name: `matte/${file}`, files: [ `matte/${file}` ], view: near } ) ),
	...pairs( 'glossy', near ), ...pairs( 'bounced', near ), ...pairs( 'asset', near ), ...pairs( 'far', far ),
];

const { browser, address, close } = await openBrowser( folder, chromium );
try {

	const page = await browser.newPage();
	page.on( 'console', ( message ) => message.text().startsWith( 'THREE.' ) && console.error( message.text() ) );
	page.on( 'pageerror', ( error ) => console.error( error ) );
	await page.setViewport( { width: 1100, height: 800 } );
	await page.goto( `${address}/relight.html` );
	await page.waitForFunction( 'window.measure', { timeout: 60000, polling: 200 } );
	const reader = await page.evaluate( () => window.reader );
	for ( const { name, code, files, view } of cases ) {

		const { still, turned, vertices } = await page.evaluate( ( ...given ) => window.measure( ...given ), code, files, view );
		const text = `${still.toExponential( 1 )}, turned ${turned.toExponential( 1 )}, of ${vertices} vertices`;
		console.log( `${reader}\trelight/${name}\t${text}${still < MOST && turned < MOST ? '' : ' WRONG'}` );

	}

	await page.screenshot( { path: `${folder}/relight.png`, fullPage: true } );

} finally {

	await close();

}
