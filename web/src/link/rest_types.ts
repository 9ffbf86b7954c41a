/**
 * Types of requests and answers, from the tower's OpenAPI document (generated/rest.gen.d.ts, `make generate`). Types
 * only: the bundle contains none of this.
 */

import type {
  FilterKeys,
  IsOperationRequestBodyOptional,
  OperationRequestBodyContent,
  PathsWithMethod,
  RequiredKeysOf,
  SuccessResponse,
} from 'openapi-typescript-helpers';

import type { components, paths } from './generated/rest.gen';

/** The parts of requests and answers, by their names in the document. */
export type Schemas = components['schemas'];

export type Method = 'GET' | 'POST' | 'PUT' | 'PATCH' | 'DELETE';

/** The paths below /api/v1 that accept this method, with their parameters in braces. */
export type PathOf<M extends Method> = PathsWithMethod<paths, Lowercase<M>>;

type OperationAt<M extends Method, P extends keyof paths> = FilterKeys<paths[P], Lowercase<M>>;

/** The JSON body of a request. */
export type BodyOf<M extends Method, P extends PathOf<M>> = OperationRequestBodyContent<OperationAt<M, P>>;

type Body<O> = [OperationRequestBodyContent<O>] extends [undefined]
  ? { readonly body?: never }
  : IsOperationRequestBodyOptional<O> extends true
    ? { readonly body?: OperationRequestBodyContent<O> }
    : { readonly body: OperationRequestBodyContent<O> };

/** Parameters by location (`path`, `query`, `header`), and the `body`. */
export type RequestOf<M extends Method, P extends PathOf<M>> =
  OperationAt<M, P> extends { readonly parameters: infer Q } ? Q & Body<OperationAt<M, P>> : never;

/** Optional if nothing in it is required. */
export type RequestArguments<M extends Method, P extends PathOf<M>> =
  RequiredKeysOf<RequestOf<M, P>> extends never ? [request?: RequestOf<M, P>] : [request: RequestOf<M, P>];

/** The JSON of a success; undefined without a body. */
export type AnswerOf<M extends Method, P extends PathOf<M>> =
  OperationAt<M, P> extends { readonly responses: infer R extends Record<string | number, unknown> }
    ? SuccessResponse<R, 'application/json'>
    : never;
