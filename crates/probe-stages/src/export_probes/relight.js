// The transport of light probes of Specula: their light under another sky, other lamps and other emission.

const ROWS = 9;

/**
 * Loads a transport.
 *
 * @param {string|URL} [url] - The file transport.json; by default, the one beside this module.
 * @return {Promise<ProbeTransport>}
 */
export async function loadTransport( url = new URL( 'transport.json', import.meta.url ) ) {

	const load = async ( url ) => {

		const response = await fetch( url );
		if ( ! response.ok ) throw new Error( `${url}: ${response.status} ${response.statusText}` );
		return response;

	};

	const response = await load( url );
	const file = await response.json();
	const bytes = await ( await load( new URL( file.numbers, response.url ) ) ).arrayBuffer();
	return new ProbeTransport( file, bytes );

}

export class ProbeTransport {

	/**
	 * @param {Object} file - The members of transport.json.
	 * @param {ArrayBuffer} bytes - The bytes of transport.bin.
	 */
	constructor( file, bytes ) {

		this.probes = file.probes;
		this.grids = file.grids;
		/** The columns of the sky, (degree + 1)^2. */
		this.columns = file.sky.columns;
		/** The names of the lamps, in the order of their colours. */
		this.lamps = file.lamps.names ?? [];
		/** The number of emissive materials that the scene uses, in the order of the glTF file, and their names, if known. */
		this.emitters = file.emission.columns;
		this.emission = file.emission.names ?? [];
		const halves = ( offset, length ) => Float32Array.from( new Uint16Array( bytes, offset, length ), fromHalf );
		const section = ( { columns, channels, offset, cpca } ) => {

			const matrices = cpca ? cpca.clusters * ( 1 + cpca.components ) : this.probes;
			const numbers = halves( offset, matrices * ROWS * columns * channels );
			const clusters = cpca && {
				components: cpca.components,
				light: new Float32Array( 3 * ROWS * matrices ),
				weights: halves( cpca.weights, this.probes * cpca.components ),
				of: new Uint8Array( bytes, cpca.cluster_of, this.probes ),
			};
			return { columns, channels, numbers, clusters };

		};

		this.sections = [ file.sky, file.emission, file.lamps ].map( section );

	}

	/**
	 * The light of all probes: 27 numbers each, red, green and blue of nine harmonics of the axes of the glTF file.
	 *
	 * @param {Array<Array<number>>} sky - Its coefficients, [r, g, b] each: `coefficients` of `export-sh` with
	 * preset = "specula". What is above the degree of the transport is not read.
	 * @param {Object} [others] - `emission`, the radiance of each emissive material, and `lamps`, the colour times the
	 * intensity of each lamp, [r, g, b] each; what is left out is dark.
	 * @param {Float32Array} [target] - Gets the numbers.
	 * @return {Float32Array}
	 */
	light( sky, { emission = [], lamps = [] } = {}, target = new Float32Array( 27 * this.probes ) ) {

		target.fill( 0 );
		[ sky, emission, lamps ].forEach( ( colours, index ) => add( this.sections[ index ], colours, target ) );
		return target;

	}

}

/** Adds the light of the columns of a section, each with a colour. */
function add( { columns, channels, numbers, clusters }, colours, target ) {

	const count = Math.min( columns, colours.length );
	if ( count === 0 ) return;
	const [ red, green, blue ] = [ 0, 1, 2 ].map( ( channel ) => {

		const values = new Float64Array( columns );
		for ( let k = 0; k < count; k ++ ) values[ k ] = colours[ k ][ channel ];
		return values;

	} );
	const lit = clusters ? clusters.light.fill( 0 ) : target;
	channels === 1 ? addGrey( numbers, red, green, blue, lit ) : addColoured( numbers, red, green, blue, lit );
	if ( clusters ) addBlends( clusters, target );

}

/** The mean of each probe's cluster, and its components times the probe's weights; three rows at a time. */
function addBlends( { components, light, weights, of }, target ) {

	for ( let probe = 0; probe < of.length; probe ++ ) {

		const first = 27 * ( 1 + components ) * of[ probe ], own = components * probe;
		for ( let part = 0; part < 27; part += 9 ) {

			let at = first + part, to = 27 * probe + part;
			let a = light[ at ], b = light[ at + 1 ], c = light[ at + 2 ], d = light[ at + 3 ], e = light[ at + 4 ];
			let f = light[ at + 5 ], g = light[ at + 6 ], h = light[ at + 7 ], i = light[ at + 8 ];
			for ( let k = 0; k < components; k ++ ) {

				const weight = weights[ own + k ];
				at += 27;
				a += weight * light[ at ], b += weight * light[ at + 1 ], c += weight * light[ at + 2 ];
				d += weight * light[ at + 3 ], e += weight * light[ at + 4 ], f += weight * light[ at + 5 ];
				g += weight * light[ at + 6 ], h += weight * light[ at + 7 ], i += weight * light[ at + 8 ];

			}

			target[ to ++ ] += a, target[ to ++ ] += b, target[ to ++ ] += c;
			target[ to ++ ] += d, target[ to ++ ] += e, target[ to ++ ] += f;
			target[ to ++ ] += g, target[ to ++ ] += h, target[ to ] += i;

		}

	}

}

/** Three rows at a time, whose sums do not wait for each other. */
function addGrey( numbers, red, green, blue, target ) {

	const columns = red.length;
	let at = 0;
	for ( let row = 0; row < target.length; row += 9, at += 3 * columns ) {

		let r0 = 0, g0 = 0, b0 = 0, r1 = 0, g1 = 0, b1 = 0, r2 = 0, g2 = 0, b2 = 0;
		for ( let k = 0, one = at, two = at + columns, three = two + columns; k < columns; k ++ ) {

			const r = red[ k ], g = green[ k ], b = blue[ k ];
			const t0 = numbers[ one ++ ], t1 = numbers[ two ++ ], t2 = numbers[ three ++ ];
			r0 += t0 * r, g0 += t0 * g, b0 += t0 * b;
			r1 += t1 * r, g1 += t1 * g, b1 += t1 * b;
			r2 += t2 * r, g2 += t2 * g, b2 += t2 * b;

		}

		target[ row ] += r0, target[ row + 1 ] += g0, target[ row + 2 ] += b0;
		target[ row + 3 ] += r1, target[ row + 4 ] += g1, target[ row + 5 ] += b1;
		target[ row + 6 ] += r2, target[ row + 7 ] += g2, target[ row + 8 ] += b2;

	}

}

function addColoured( numbers, red, green, blue, target ) {

	let at = 0;
	for ( let row = 0; row < target.length; row += 3 ) {

		let r = 0, g = 0, b = 0;
		for ( let k = 0; k < red.length; k ++, at += 3 ) {

			r += numbers[ at ] * red[ k ];
			g += numbers[ at + 1 ] * green[ k ];
			b += numbers[ at + 2 ] * blue[ k ];

		}

		target[ row ] += r, target[ row + 1 ] += g, target[ row + 2 ] += b;

	}

}

/**
 * Shows light in the grids of three.js that probes.js loaded from files with format = "float".
 *
 * @param {Array<Object>} grids - The grids, in the order of the file.
 * @param {ProbeTransport} transport - The transport.
 * @param {Float32Array} light - What its `light` returned.
 */
export function setLight( grids, transport, light ) {

	grids.forEach( ( { texture }, index ) => {

		const { resolution: [ nx, ny, nz ], first } = transport.grids[ index ];
		const texels = texture.image.data, slice = nx * ny;
		if ( ! ( texels instanceof Float32Array ) ) throw new Error( 'export the probes with format = "float"' );
		let at = 0;
		for ( let part = 0; part < 7; part ++ ) for ( let z = - 1; z <= nz; z ++ ) {

			const start = first + slice * Math.min( Math.max( z, 0 ), nz - 1 );
			for ( let probe = start; probe < start + slice; probe ++ ) for ( let k = 4 * part; k < 4 * part + 4; k ++ ) {

				texels[ at ++ ] = k < 27 ? light[ 27 * probe + k ] : 0;

			}

		}

		texture.needsUpdate = true;

	} );

}

function fromHalf( bits ) {

	const exponent = bits >> 10 & 31, fraction = bits & 1023;
	const size = exponent === 0 ? fraction * 2 ** - 24 : ( 1 + fraction / 1024 ) * 2 ** ( exponent - 15 );
	return bits & 0x8000 ? - size : size;

}
