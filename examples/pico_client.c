/* Asks a running service for the set-points of a stance, with zenoh-pico or zenoh-c (1.x) alone.
 *
 *   crux serve -l tcp/127.0.0.1:7447
 *   cc -std=c11 -DZENOH_LINUX examples/pico_client.c -lzenohpico -o pico_client
 *   cc -std=c11 -DZENOH_C examples/pico_client.c -lzenohc -o pico_client
 *   ./pico_client tcp/127.0.0.1:7447
 *
 * As it is built by default, zenoh-pico drops a message of more than Z_FRAG_MAX_SIZE = 4096 bytes
 * without a word: the query then ends without a reply. max_reply_bytes keeps replies below that;
 * 96 bytes are left for zenoh's own part of the message, in which the key and the encoding are.
 */

#include <stdio.h>

#ifdef ZENOH_C
#include <zenoh.h>
#else
#include <zenoh-pico.h>

#if Z_FEATURE_QUERY != 1 || Z_FEATURE_MULTI_THREAD != 1
#error "zenoh-pico is to be built with Z_FEATURE_QUERY and Z_FEATURE_MULTI_THREAD"
#endif
#endif

#define KEY "crux/robosimian/plan"
#define TIMEOUT_MS 10000

#define WRIST "\"orientation\":[0.707106781,0,0.707106781,0]}"
#define HOLD                                                          \
    "\"hold\":{\"shape\":\"cylinder\",\"diameter\":0.3},\"surface\":\"rock\"," \
    "\"grasp\":{\"outer_rotation\":3.141592653589793}}"

static const char REQUEST[] =
    "{\"v\":1,\"id\":\"pico\",\"detail\":\"set_points\",\"max_reply_bytes\":4000,"
    "\"stance\":{\"body\":{\"position\":[-0.45,0,0],"
    "\"orientation\":[0,-0.707106781,0,0.707106781]},"
    "\"hands\":["
    "{\"limb\":\"front_right\",\"pose\":{\"position\":[0,-0.45,0.6]," WRIST "," HOLD ","
    "{\"limb\":\"rear_right\",\"pose\":{\"position\":[0,-0.45,-0.6]," WRIST "," HOLD ","
    "{\"limb\":\"rear_left\",\"pose\":{\"position\":[0,0.45,-0.6]," WRIST "," HOLD ","
    "{\"limb\":\"front_left\",\"pose\":{\"position\":[0,0.45,0.6]," WRIST "," HOLD "]}}";

static void print_payload(const z_loaned_bytes_t *payload, FILE *out) {
    z_owned_string_t text;
    if (z_bytes_to_string(payload, &text) < 0) {
        fprintf(stderr, "no memory for a reply\n");
        return;
    }
    fprintf(out, "%.*s\n", (int)z_string_len(z_loan(text)), z_string_data(z_loan(text)));
    z_drop(z_move(text));
}

/* Returns 0 for a plan, 1 for an error of the service, 2 without a reply. */
static int ask(const z_loaned_session_t *session) {
    z_view_keyexpr_t key;
    z_owned_bytes_t payload;
    z_owned_encoding_t encoding;
    if (z_view_keyexpr_from_str(&key, KEY) < 0 || z_bytes_from_static_str(&payload, REQUEST) < 0 ||
        z_encoding_from_str(&encoding, "application/json") < 0) {
        fprintf(stderr, "no memory for the request\n");
        return 2;
    }
    z_get_options_t options;
    z_get_options_default(&options);
    options.payload = z_move(payload);
    options.encoding = z_move(encoding);
    options.timeout_ms = TIMEOUT_MS;

    z_owned_closure_reply_t closure;
    z_owned_fifo_handler_reply_t replies;
    /* zenoh-c returns nothing here; without memory, the query is not sent */
    z_fifo_channel_reply_new(&closure, &replies, 1);
    if (z_get(session, z_loan(key), "", z_move(closure), &options) < 0) {
        fprintf(stderr, "the query cannot be sent\n");
        return 2;
    }
    int status = 2;
    z_owned_reply_t reply;
    while (z_recv(z_loan(replies), &reply) == Z_OK) {
        if (z_reply_is_ok(z_loan(reply))) {
            print_payload(z_sample_payload(z_reply_ok(z_loan(reply))), stdout);
            status = 0;
        } else {
            print_payload(z_reply_err_payload(z_reply_err(z_loan(reply))), stderr);
            status = 1;
        }
        z_drop(z_move(reply));
    }
    z_drop(z_move(replies));
    if (status == 2) {
        fprintf(stderr, "no reply: no service answers at " KEY ", or its reply is too large\n");
    }
    return status;
}

static void configure(z_owned_config_t *config, const char *endpoint) {
    z_config_default(config);
#ifdef ZENOH_C
    char endpoints[256];
    snprintf(endpoints, sizeof endpoints, "[\"%s\"]", endpoint);
    zc_config_insert_json5(z_loan_mut(*config), "mode", "\"client\"");
    zc_config_insert_json5(z_loan_mut(*config), "connect/endpoints", endpoints);
#else
    zp_config_insert(z_loan_mut(*config), Z_CONFIG_MODE_KEY, Z_CONFIG_MODE_CLIENT);
    zp_config_insert(z_loan_mut(*config), Z_CONFIG_CONNECT_KEY, endpoint);
#endif
}

int main(int argc, char **argv) {
    z_owned_config_t config;
    configure(&config, argc > 1 ? argv[1] : "tcp/127.0.0.1:7447");
    z_owned_session_t session;
    if (z_open(&session, z_move(config), NULL) < 0) {
        fprintf(stderr, "no zenoh session: does crux serve listen there?\n");
        return 2;
    }
#ifndef ZENOH_C
    /* newer versions have started both by themselves, and return 0 then, too */
    if (zp_start_read_task(z_loan_mut(session), NULL) < 0 ||
        zp_start_lease_task(z_loan_mut(session), NULL) < 0) {
        fprintf(stderr, "the tasks of the session cannot be started\n");
        z_drop(z_move(session));
        return 2;
    }
#endif
    const int status = ask(z_loan(session));
    z_drop(z_move(session));
    return status;
}
