// Light probes of Specula for three.js, from revision 184 on.

import { Data3DTexture, FloatType, HalfFloatType, LinearFilter, REVISION, RGBAFormat } from 'three';

/**
 * Loads the grids of a file, which are to be added to a scene.
 *
 * @param {Function} Grid - LightProbeGridWebGL for WebGLRenderer, LightProbeGrid for WebGPURenderer, both of
 * three/addons/lighting. Before revision 186, LightProbeGrid is that of WebGLRenderer.
 * @param {string|URL} [url] - The file probes.json; by default, the one beside this module.
 * @return {Promise<Array<Object>>} A grid for each volume. Where several overlap, the first one counts.
 */
export async function loadLightProbes( Grid, url = new URL( 'probes.json', import.meta.url ) ) {

	const load = async ( url ) => {

		const response = await fetch( url );
		if ( ! response.ok ) throw new Error( `${url}: ${response.status} ${response.statusText}` );
		return response;

	};

	const response = await load( url );
	const { precision, texels: name, grids } = await response.json();
	const bytes = await ( await load( new URL( name, response.url ) ) ).arrayBuffer();
	// Until revision 186, the outer probes are the corners of a grid; since, each is in the middle of a cell.
	const hasCells = parseInt( REVISION ) >= 187;
	return grids.map( ( { name, resolution: [ nx, ny, nz ], cells, corners, offset }, index ) => {

		const [ min, max ] = hasCells ? cells : corners;
		const size = max.map( ( x, axis ) => x - min[ axis ] );
		if ( size.some( ( length ) => ! ( length > 0 ) ) ) {

			throw new Error( `${name}: three.js r${REVISION} needs two probes along each axis; use r187` );

		}

		const numbers = precision === 'half' ? Uint16Array : Float32Array;
		const texture = new Data3DTexture( new numbers( bytes, offset, 28 * nx * ny * ( nz + 2 ) ), nx, ny, 7 * ( nz + 2 ) );
		texture.format = RGBAFormat;
		texture.type = precision === 'half' ? HalfFloatType : FloatType;
		texture.minFilter = texture.magFilter = LinearFilter;
		texture.needsUpdate = true;

		const grid = new Grid( ...size, nx, ny, nz );
		grid.name = name;
		grid.position.set( ...min.map( ( x, axis ) => x + size[ axis ] / 2 ) );
		grid.priority = - index;
		grid.texture = texture;
		grid.updateBoundingBox();
		return grid;

	} );

}
