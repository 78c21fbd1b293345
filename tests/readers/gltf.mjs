// Validates the meshes of run.sh with the validator of the Khronos Group, and compares the assets that came back with those
// that went in: a line for each.

import fs from 'fs';
import path from 'path';
import { createRequire } from 'module';

const folder = process.argv[ 2 ];
const { validateBytes } = createRequire( path.resolve( 'package.json' ) )( 'gltf-validator' );
const bytes = ( file ) => new Uint8Array( fs.readFileSync( `${folder}/${file}` ) );
const said = ( file, text ) => console.log( `glTF-Validator\t${file}\t${text}` );

async function validate( file ) {

	const externalResourceFunction = async ( uri ) => bytes( decodeURIComponent( uri ) );
	const { issues } = await validateBytes( bytes( file ), { uri: file, maxIssues: 0, externalResourceFunction } );
	return issues;

}

/** The JSON of a .glb. */
function json( file ) {

	const data = bytes( file );
	const length = new DataView( data.buffer, data.byteOffset ).getUint32( 12, true );
	return JSON.parse( new TextDecoder().decode( data.subarray( 20, 20 + length ) ) );

}

/** The path of each value of a document that is not in another as it is. */
function lost( before, after, at = '' ) {

	if ( before === null || typeof before !== 'object' ) return before === after ? [] : [ at ];
	if ( after === null || typeof after !== 'object' ) return [ at ];
	return Object.keys( before ).flatMap( ( key ) => lost( before[ key ], after[ key ], `${at}/${key}` ) );

}

// Buffers become one, with the pictures in it, and the second node of a mesh shows a copy.
const MAY_CHANGE = [ /^\/buffers\//, /^\/bufferViews\/\d+\/(buffer|byteOffset)$/, /^\/images\/\d+\/uri$/, /^\/nodes\/\d+\/mesh$/ ];

for ( const name of fs.readdirSync( folder ).filter( ( file ) => file.endsWith( '.gltf' ) ) ) {

	const stem = name.slice( 0, - '.gltf'.length );
	const source = await validate( name );
	for ( const kind of [ 'alone', 'asset' ] ) {

		const file = `out/${kind}/${stem}.glb`;
		try {

			const { numErrors, numWarnings, messages } = await validate( file );
			const before = kind === 'asset' ? source : { numErrors: 0, numWarnings: 0 };
			const worst = messages.filter( ( { severity } ) => severity < 2 ).map( ( { code, pointer } ) => `${code} ${pointer}` );
			if ( numErrors > before.numErrors || numWarnings > before.numWarnings ) throw new Error( [ ...new Set( worst ) ].slice( 0, 5 ).join( ', ' ) );
			let text = `${numErrors} errors, ${numWarnings} warnings`;
			if ( kind === 'asset' ) {

				const document = JSON.parse( new TextDecoder().decode( bytes( name ) ) );
				const changed = lost( document, json( file ) ).filter( ( at ) => ! MAY_CHANGE.some( ( may ) => may.test( at ) ) );
				if ( changed.length ) throw new Error( `changed: ${changed.slice( 0, 5 ).join( ', ' )}` );
				text += `, as the asset has ${before.numErrors} and ${before.numWarnings}; nothing of it is lost`;

			}

			said( `gltf/${file}`, text );

		} catch ( failure ) {

			said( `gltf/${file}`, `WRONG: ${failure}` );

		}

	}

}
