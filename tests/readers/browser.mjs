// A headless browser with software for a graphics device, and a server for the pages of this folder and the
// files of another.

import fs from 'fs';
import { createServer } from 'http';
import { createRequire } from 'module';
import path from 'path';
import { fileURLToPath } from 'url';

const here = path.dirname( fileURLToPath( import.meta.url ) );
const TYPES = { '.html': 'text/html', '.js': 'text/javascript' };

/** What drives browsers, from the packages of this directory. */
export const puppeteer = () => createRequire( path.resolve( 'package.json' ) )( 'puppeteer-core' );

/** Serves pages from here, packages from this directory, and the files and exports of `folder`. */
export async function openBrowser( folder, executablePath ) {

	const server = createServer( ( request, response ) => {

		const { pathname } = new URL( request.url, 'http://localhost' );
		const isPackage = pathname.startsWith( '/node_modules/' );
		const places = pathname.endsWith( '.html' ) ? [ here ] : isPackage ? [ '.' ] : [ folder, `${folder}/out` ];
		const file = places.map( ( place ) => place + pathname ).find( ( file ) => fs.statSync( file, { throwIfNoEntry: false } )?.isFile() );
		if ( ! file ) return response.writeHead( 404 ).end();
		response.writeHead( 200, { 'content-type': TYPES[ path.extname( file ) ] ?? 'application/octet-stream' } );
		response.end( fs.readFileSync( file ) );

	} ).listen( 0, '127.0.0.1' );
	await new Promise( ( done ) => server.once( 'listening', done ) );
	// Chromium's own software, and not the Vulkan driver that tests of Specula are given: with that, pages stand still.
	const { VK_DRIVER_FILES, VK_ICD_FILENAMES, ...env } = process.env;
	const browser = await puppeteer().launch( { executablePath, env, protocolTimeout: 1200000, args: [
		'--no-sandbox', '--disable-dev-shm-usage', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
		'--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader',
	] } );
	const close = async () => { await browser.close(); server.close(); };
	return { browser, address: `http://127.0.0.1:${server.address().port}`, close };

}
