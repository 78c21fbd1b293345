// Whether the pages that people read keep their layout in a browser: on a phone, a laptop and a large screen, in light and dark.
// node pages.mjs FOLDER CHROMIUM, in the folder of node_modules; FOLDER/pages has report.html and timings.html, in any folder.
// By the boxes of the page with everything unfolded: the page does not scroll sideways, and from 1280 pixels on nothing in it
// does; no text leaves its cell or covers another; the recommended export of every pair is in sight. Prints lines as readers.mjs does.

import fs from 'fs';
import { openBrowser } from './browser.mjs';

const [ folder, chromium ] = process.argv.slice( 2 );
const widths = [ 390, 1280, 2560 ];
const schemes = [ 'light', 'dark' ];

/** In the page: what is wrong with its layout, a line each. */
function faults() {

	const found = [];
	const name = ( element ) => `${element.tagName.toLowerCase()}${element.className ? '.' + ( element.className.baseVal ?? element.className ) : ''} "${element.textContent.trim().slice( 0, 30 )}"`;
	for ( const details of document.querySelectorAll( 'details' ) ) details.open = true;

	const { scrollWidth } = document.documentElement;
	if ( scrollWidth > innerWidth ) found.push( `the page is ${scrollWidth} wide` );
	for ( const element of document.querySelectorAll( 'body *' ) ) {

		const scrolls = [ 'auto', 'scroll' ].includes( getComputedStyle( element ).overflowX );
		if ( scrolls && innerWidth >= 1280 && element.scrollWidth > element.clientWidth ) found.push( `${name( element )} scrolls` );

	}

	// The boxes of all lines of text, as far as what is around them shows them.
	const boxes = [];
	const texts = document.createTreeWalker( document.body, NodeFilter.SHOW_TEXT );
	while ( texts.nextNode() ) {

		const parent = texts.currentNode.parentElement;
		if ( ! texts.currentNode.data.trim() || [ 'STYLE', 'title' ].includes( parent.tagName ) ) continue;
		const range = document.createRange();
		range.selectNodeContents( texts.currentNode );
		for ( const line of range.getClientRects() ) {

			const box = { left: line.left, right: line.right, top: line.top, bottom: line.bottom, parent };
			const cell = parent.closest( 'th, td, dt, dd, figcaption' )?.getBoundingClientRect();
			if ( cell && ( box.left < cell.left - 1 || box.right > cell.right + 1 ) ) found.push( `${name( parent )} leaves its cell` );
			for ( let around = parent; around !== document.body; around = around.parentElement ) {

				if ( getComputedStyle( around ).overflowX === 'visible' || around.namespaceURI.endsWith( 'svg' ) ) continue;
				const edge = around.getBoundingClientRect();
				box.left = Math.max( box.left, edge.left );
				box.right = Math.min( box.right, edge.right );

			}

			// Of a line's height, letters take the middle.
			const rest = 0.2 * ( box.bottom - box.top );
			if ( box.right - box.left > 1 ) boxes.push( { ...box, top: box.top + rest, bottom: box.bottom - rest } );

		}

	}

	boxes.sort( ( a, b ) => a.top - b.top );
	for ( const [ place, a ] of boxes.entries() ) {

		for ( let other = place + 1; other < boxes.length && boxes[ other ].top < a.bottom - 1; other ++ ) {

			const b = boxes[ other ];
			if ( Math.min( a.right, b.right ) - Math.max( a.left, b.left ) > 1 ) found.push( `${name( a.parent )} and ${name( b.parent )} overlap` );

		}

	}

	// What a style writes before a cell has no text in the page, but makes its content wider.
	for ( const cell of document.querySelectorAll( 'th, td' ) ) if ( cell.scrollWidth > cell.clientWidth + 1 ) found.push( `${name( cell )} is narrower than its content` );

	for ( const use of document.querySelectorAll( '.pairs td.use' ) ) {

		const { left, right, height } = use.getBoundingClientRect();
		if ( left < 0 || right > innerWidth || height === 0 ) found.push( `${name( use )} is out of sight` );

	}

	return found;

}

const { browser, close } = await openBrowser( folder, chromium );

async function open( file, width, scheme ) {

	const page = await browser.newPage();
	await page.setViewport( { width, height: 800 } );
	await page.emulateMediaFeatures( [ { name: 'prefers-color-scheme', value: scheme } ] );
	await page.goto( `file://${fs.realpathSync( file )}` );
	return page;

}

try {

	const pages = fs.readdirSync( `${folder}/pages`, { recursive: true } ).filter( ( file ) => /(report|timings)\.html$/.test( file ) );
	if ( pages.length < 2 ) console.log( `chromium\tpages\t${pages.length} of 2 pages WRONG` );
	for ( const file of pages ) for ( const width of widths ) for ( const scheme of schemes ) {

		const page = await open( `${folder}/pages/${file}`, width, scheme );
		const found = await page.evaluate( faults );
		const said = found.length ? `${found.length} faults, WRONG: ${found.slice( 0, 4 ).join( '; ' )}` : 'no fault';
		console.log( `chromium\t${file.split( '/' ).pop()}, ${width}, ${scheme}\t${said}` );
		await page.close();

	}

	// A layout that is broken on purpose has each fault, so that no check passes whatever it sees.
	const report = pages.find( ( file ) => file.endsWith( 'report.html' ) );
	const page = await open( `${folder}/pages/${report}`, 1280, 'light' );
	await page.addStyleTag( { content: '.pairs td { min-width: 900px } dt { width: 20px } h2 { height: 0; margin: 0; padding: 0; border: 0 } .scroll { width: 200px }' } );
	const found = ( await page.evaluate( faults ) ).join( '\n' );
	const missed = [ 'the page is', 'scrolls', 'leaves its cell', 'overlap', 'out of sight' ].filter( ( fault ) => ! found.includes( fault ) );
	console.log( `chromium\ta broken page\t${missed.length ? `WRONG: not found: ${missed.join( ', ' )}` : 'every fault is found'}` );

} finally {

	await close();

}
