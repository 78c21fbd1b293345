// The look-ups of docs/taps.md in 64-bit numbers, of the tensors that `export-taps` writes, and how far a
// renderer may be from them. Directions are in Specula's frame.

import fs from 'fs';

export const CHANNELS = [ 0, 1, 2 ];
export const add = ( ...vectors ) => CHANNELS.map( ( c ) => vectors.reduce( ( sum, v ) => sum + v[ c ], 0 ) );
export const times = ( factor, v ) => v.map( ( x ) => factor * x );
export const dot = ( a, b ) => a[ 0 ] * b[ 0 ] + a[ 1 ] * b[ 1 ] + a[ 2 ] * b[ 2 ];
export const unit = ( v ) => times( 1 / Math.hypot( ...v ), v );
export const cross = ( a, b ) => CHANNELS.map( ( c ) => a[ ( c + 1 ) % 3 ] * b[ ( c + 2 ) % 3 ] - a[ ( c + 2 ) % 3 ] * b[ ( c + 1 ) % 3 ] );
const mix = ( a, b, share ) => a.map( ( x, c ) => x + share * ( b[ c ] - x ) );

// --- Facets: views from all sides, and the normals of a ball that each of them sees, with a tangent each ---

const VIEWS = 16, NORMALS = 64;
const GOLDEN = Math.PI * ( 3 - Math.sqrt( 5 ) );
export const views = Array.from( { length: VIEWS }, ( _, k ) => {

	const z = 1 - ( 2 * k + 1 ) / VIEWS, side = Math.sqrt( 1 - z * z );
	const view = [ side * Math.cos( GOLDEN * k ), side * Math.sin( GOLDEN * k ), z ];
	const right = unit( cross( [ 0.3, 0.5, 0.8 ], view ) ), up = cross( view, right );
	const normals = Array.from( { length: NORMALS }, ( _, j ) => {

		const sine = Math.sqrt( ( j + 0.5 ) / NORMALS ), turn = GOLDEN * ( j + 0.37 * k );
		return add( times( sine * Math.cos( turn ), right ), times( sine * Math.sin( turn ), up ), times( Math.sqrt( 1 - sine * sine ), view ) );

	} );
	const tangents = normals.map( ( normal, j ) => {

		const x = unit( cross( normal, up ) ), y = cross( normal, x ), turn = GOLDEN * ( 5 * j + k );
		return add( times( Math.cos( turn ), x ), times( Math.sin( turn ), y ) );

	} );
	return { view, normals, tangents };

} );
export const facets = views.flatMap( ( { view, normals, tangents } ) => normals.map( ( normal, j ) => ( { view, normal, tangent: tangents[ j ] } ) ) );

// --- The formula of docs/taps.md, and how far a renderer may be from it ------------------------------------

/** The pairs of `taps.toml`, ENVIRONMENT/MATERIAL. */
export const namesOf = ( folder ) => fs.readdirSync( `${folder}/out/numbers`, { recursive: true } )
	.filter( ( file ) => file.endsWith( '.safetensors' ) ).map( ( file ) => file.slice( 0, - '.safetensors'.length ) ).sort();

export function readTensors( file ) {

	const bytes = fs.readFileSync( file );
	const length = Number( bytes.readBigUInt64LE() );
	const begin = 8 + length, tensors = {};
	const { __metadata__, ...header } = JSON.parse( bytes.subarray( 8, begin ) );
	for ( const [ name, { dtype, shape, data_offsets: [ from, to ] } ] of Object.entries( header ) ) {

		const data = bytes.buffer.slice( bytes.byteOffset + begin + from, bytes.byteOffset + begin + to );
		tensors[ name ] = { shape, data: dtype === 'F64' ? new Float64Array( data ) : new Float32Array( data ) };

	}

	return tensors;

}

// The face and the place there, from -1 to 1, as OpenGL's table has them.
function toFace( [ x, y, z ] ) {

	const [ a, b, c ] = [ x, y, z ].map( Math.abs );
	if ( a >= b && a >= c ) return x > 0 ? [ 0, - z / a, - y / a ] : [ 1, z / a, - y / a ];
	if ( b >= c ) return y > 0 ? [ 2, x / b, z / b ] : [ 3, x / b, - z / b ];
	return z > 0 ? [ 4, x / c, - y / c ] : [ 5, - x / c, - y / c ];

}

function fromFace( face, s, t ) {

	return [ [ 1, - t, - s ], [ - 1, - t, s ], [ s, 1, t ], [ s, - 1, - t ], [ s, - t, 1 ], [ - s, - t, - 1 ] ][ face ];

}

// The texel of a cube at a row and a column, which may be one beyond the edge: then it is on the next face,
// or, at a corner, the mean of the three texels that meet there.
function texel( { data, shape: [ , n ] }, face, row, column ) {

	const at = ( f, r, c ) => CHANNELS.map( ( channel ) => data[ 3 * ( ( f * n + r ) * n + c ) + channel ] );
	const beyond = ( k ) => k < 0 || k >= n, inside = ( k ) => Math.min( Math.max( k, 0 ), n - 1 );
	if ( beyond( row ) && beyond( column ) ) {

		const three = [ [ inside( row ), inside( column ) ], [ row, inside( column ) ], [ inside( row ), column ] ];
		return times( 1 / 3, add( ...three.map( ( [ r, c ] ) => texel( { data, shape: [ 6, n ] }, face, r, c ) ) ) );

	}

	if ( ! beyond( row ) && ! beyond( column ) ) return at( face, row, column );
	// Just past the edge, so that the place along it stays.
	const place = ( k ) => beyond( k ) ? ( k < 0 ? - 1 : 1 ) * ( 1 + 1e-9 ) : ( 2 * k + 1 ) / n - 1;
	const [ other, s, t ] = toFace( fromFace( face, place( column ), place( row ) ) );
	return at( other, ...[ t, s ].map( ( x ) => inside( Math.floor( n * ( x + 1 ) / 2 ) ) ) );

}

// The four texels of a bilinear look-up, its value, and whether they are on more than one face.
function bilinear( cube, d ) {

	const [ face, s, t ] = toFace( [ - d[ 1 ], d[ 2 ], d[ 0 ] ] );
	const [ x, y ] = [ s, t ].map( ( place ) => cube.shape[ 1 ] * ( place + 1 ) / 2 - 0.5 );
	const [ column, row ] = [ x, y ].map( Math.floor );
	const four = [ [ 0, 0 ], [ 0, 1 ], [ 1, 0 ], [ 1, 1 ] ].map( ( [ r, c ] ) => texel( cube, face, row + r, column + c ) );
	const crosses = [ column, row ].some( ( k ) => k < 0 || k + 1 >= cube.shape[ 1 ] );
	return { four, crosses, value: mix( mix( four[ 0 ], four[ 1 ], x - column ), mix( four[ 2 ], four[ 3 ], x - column ), y - row ) };

}

// A filter takes places between texels in 256 steps, so in each direction half a step of the difference may
// be lost.
const FILTER = 1 / 512;
const range = ( four ) => CHANNELS.map( ( c ) => Math.max( ...four.map( ( v ) => v[ c ] ) ) - Math.min( ...four.map( ( v ) => v[ c ] ) ) );
// The largest error of rounding to a half.
const ofHalf = ( x ) => 2 ** Math.max( Math.floor( Math.log2( Math.abs( x ) || 1e-9 ) ) - 11, - 25 );

/**
 * What rounding does to the texels of a look-up: to halves, and to mantissas of 9 bits under the exponent of the
 * largest colour.
 */
export const halves = ( four ) => CHANNELS.map( ( c ) => Math.max( ...four.map( ( v ) => ofHalf( v[ c ] ) ) ) );
export const rgb9e5 = ( four ) => CHANNELS.map( () => Math.max( ...four.flat() ) * 2 ** - 9 );

/**
 * The look-ups of one pair: the radiance, the error that a renderer may have in each colour, and whether any
 * look-up is on more than one face of a cube.
 */
export function formula( tensors, rounding = halves ) {

	const levels = Object.keys( tensors ).filter( ( name ) => name.startsWith( 'level_' ) ).sort().map( ( name ) => tensors[ name ] );
	const kernels = [ 0, 1, 2, 3 ].map( ( k ) => tensors[ `normal_${k}` ] );
	const [ count, size ] = tensors.taps.shape.slice( - 2 ), [ about ] = tensors.normals.shape.slice( - 2 );
	const isFacets = size === 6, [ side ] = tensors.taps.shape, isQuarter = side === 25;
	const numbers = ( { data, shape }, i, j ) => {

		const [ taps, size ] = shape.slice( - 2 );
		return [ ...data.subarray( ( i * taps + j ) * size ).subarray( 0, size ) ];

	};

	// The numbers of a tap at a place between two rows of the table, or between four nodes in two directions, and
	// what rounding and filtering may do to each of them.
	const row = ( tensor, place, j, map ) => {

		const steps = place.map( ( x ) => Math.min( Math.floor( x ), side - 2 ) ), shares = place.map( ( x, axis ) => x - steps[ axis ] );
		const at = ( index ) => map( numbers( tensor, index, j ) );
		const rows = isFacets ? [ steps[ 1 ], steps[ 1 ] + 1 ].map( ( y ) => [ at( y * side + steps[ 0 ] ), at( y * side + steps[ 0 ] + 1 ) ] ) :
			[ [ at( steps[ 0 ] ), at( steps[ 0 ] + 1 ) ] ];
		const across = rows.map( ( [ a, b ] ) => mix( a, b, shares[ 0 ] ) ), all = rows.flat();
		const value = isFacets ? mix( ...across, shares[ 1 ] ) : across[ 0 ];
		const error = value.map( ( _, k ) => {

			const values = all.map( ( numbers ) => numbers[ k ] );
			return Math.max( ...values.map( ofHalf ) ) + rows.length * FILTER * ( Math.max( ...values ) - Math.min( ...values ) );

		} );
		return { value, error };

	};

	const between = ( cubes, d, x, share ) => {

		const place = Math.min( Math.max( x, 0 ), cubes.length - 1.001 ), k = Math.floor( place ), f = place - k;
		const found = [ k, k + 1 ].map( ( k ) => bilinear( cubes[ k ], d ) );
		const value = mix( found[ 0 ].value, found[ 1 ].value, share( f ) );
		// Texels are rounded, and filtered along two directions.
		const error = mix( ...found.map( ( { four } ) => add( rounding( four ), times( 2 * FILTER, range( four ) ) ) ), share( f ) );
		return { value, error, crosses: found.some( ( { crosses } ) => crosses ) };

	};

	const first = Math.log2( tensors.std.data[ 0 ] );
	const blurred = ( d, log ) => between( levels, d, 4 * ( log - first ), ( f ) => ( 2 ** ( f / 2 ) - 1 ) * ( 1 + Math.SQRT2 ) );
	const differs = ( a, b ) => CHANNELS.map( ( c ) => Math.abs( a[ c ] - b[ c ] ) );

	// Where a view looks into the table, and where a tap of these numbers looks into the levels.
	const byAngle = ( { normal, view } ) => {

		const cosine = dot( normal, view );
		const R = add( times( 2 * cosine, normal ), times( - 1, view ) ), T = unit( add( normal, times( - cosine, R ) ) );
		return { place: [ 64 * ( 1 - cosine ) ], toward: ( [ delta ] ) => add( times( Math.cos( delta ), R ), times( Math.sin( delta ), T ) ) };

	};

	const byFacet = ( { normal, tangent, view } ) => {

		const X = unit( add( tangent, times( - dot( normal, tangent ), normal ) ) ), Y = cross( normal, X );
		const v = [ X, Y, normal ].map( ( axis ) => dot( view, axis ) ), rim = Math.sqrt( ( 1 + v[ 2 ] ) * ( 1 + Math.sqrt( v[ 2 ] ) ) );
		const disc = [ v[ 0 ] / rim, v[ 1 ] / rim ], signs = disc.map( ( x ) => isQuarter && x < 0 ? - 1 : 1 );
		const place = disc.map( ( x, axis ) => ( side - 1 ) * ( isQuarter ? signs[ axis ] * x : ( x + 1 ) / 2 ) );
		const toward = ( [ p, q ] ) => {

			const h = [ signs[ 0 ] * p, signs[ 1 ] * q, 1 ], l = add( times( 2 * dot( v, h ) / dot( h, h ), h ), times( - 1, v ) );
			return add( times( l[ 0 ], X ), times( l[ 1 ], Y ), times( l[ 2 ], normal ) );

		};

		return { place, toward };

	};

	return ( facet ) => {

		const { normal } = facet, { place, toward } = isFacets ? byFacet( facet ) : byAngle( facet );
		const sum = [ 0, 0, 0 ], most = [ 0, 0, 0 ];
		let crosses = false;
		const tap = ( weight, weightError, light, lightError ) => {

			crosses ||= light.crosses;
			CHANNELS.forEach( ( c ) => {

				sum[ c ] += weight[ c ] * light.value[ c ];
				most[ c ] += weight[ c ] * lightError[ c ] + weightError[ c ] * light.value[ c ];

			} );

		};

		for ( let j = 0; j < count; j ++ ) {

			// An angle or two slopes, then the width and the weight.
			const { value, error } = row( tensors.taps, place, j, ( numbers ) => numbers.map( ( x, k ) => k === size - 4 ? Math.log2( x ) : x ) );
			const shape = value.slice( 0, - 3 ), at = ( shape ) => blurred( toward( shape ), shape.at( - 1 ) ), light = at( shape );
			const farthest = shape.map( ( _, k ) => {

				const moved = [ - 1, 1 ].map( ( sign ) => at( shape.map( ( x, i ) => i === k ? x + sign * error[ k ] : x ) ) );
				const [ one, other ] = moved.map( ( { value } ) => differs( value, light.value ) );
				return CHANNELS.map( ( c ) => Math.max( one[ c ], other[ c ] ) );

			} );
			tap( value.slice( - 3 ), error.slice( - 3 ), light, add( light.error, ...farthest ) );

		}

		for ( let j = 0; j < about; j ++ ) {

			const { value: [ y, ...weight ], error: [ yError, ...weightError ] } = row( tensors.normals, place, j, ( row ) => row );
			const at = ( y ) => between( kernels, normal, 3 * y, ( f ) => f );
			const light = at( y );
			tap( weight, weightError, light, add( light.error, differs( at( y + yError ).value, at( y - yError ).value ) ) );

		}

		return { value: sum, error: most, crosses };

	};

}

/** The largest error of colours in shares of a pixel's largest, and of what the formula allows, as a text. */
export function compared( found, lookUps, brightest = Infinity ) {

	let [ most, share ] = [ 0, 0 ];
	found.forEach( ( rgb, k ) => rgb.forEach( ( x, c ) => {

		const { value, error } = lookUps[ k ], difference = Math.abs( x - Math.min( value[ c ], brightest ) );
		most = Math.max( most, difference / Math.max( ...value ) );
		share = Math.max( share, difference / error[ c ] );

	} ) );
	const text = `${most.toExponential( 1 )}, ${share.toFixed( 2 )} of what rounding explains`;
	return share < 1 ? text : `${text} WRONG: more`;

}
