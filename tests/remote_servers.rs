//! A shared cache on servers as studios set them up: a second implementation (BuildGrid), TLS and tokens,
//! little room, and a proxy of the site.

use std::time::Instant;

use crate::support::buildgrid::{Access, Authority, BuildGrid};
use crate::support::casd::{Server, assert_same, built, warnings};
use crate::support::{Project, Run, files_below, ran};

#[test]
fn what_one_folder_stores_in_buildgrid_another_finds() {
    let Some(server) = BuildGrid::start("what_one_folder_stores_in_buildgrid", Access::default()) else {
        return;
    };
    let (here, there) = (Project::small(), Project::small());
    let address = server.address("grpc");
    let (first, events) = built(&here, &[&address]);
    let items = first["ran"].as_u64().unwrap();
    assert_eq!((items > 20, warnings(&events)), (true, vec![]), "{first}");
    let start = Instant::now();
    let (second, events) = built(&there, &[&address]);
    println!("{items} items from BuildGrid in {:.2?}", start.elapsed());
    assert_eq!((&second["ran"], second["shared"].as_u64()), (&0.into(), Some(items)), "{second}");
    assert_eq!(warnings(&events), [""; 0]);
    assert_same(&there.outputs(), &here.outputs(), 0);
}

/// Builds a new project. What is secret is nowhere in what the build says and leaves.
fn build_in_secret(options: &[&str], secrets: &[&str]) -> (Project, Run) {
    let project = Project::small();
    let run = project.specula(&[&["build", "--json"], options].concat());
    let mut left = files_below(&project.path(".specula"));
    left.insert("stdout".into(), run.stdout.clone().into());
    left.insert("stderr".into(), run.stderr.clone().into());
    for (secret, (name, bytes)) in
        secrets.iter().flat_map(|secret| left.iter().map(move |file| (secret, file)))
    {
        let is_in = bytes.windows(secret.len()).any(|part| part == secret.as_bytes());
        assert!(!is_in, "a secret is in {name}");
    }
    (project, run)
}

fn events_of(run: &Run) -> Vec<serde_json::Value> {
    run.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// A build with these options makes everything here, with one warning that says what to check; if the cache
/// is required, it ends with exit code 4.
fn is_refused(case: &str, options: &[&str], secrets: &[&str], advice: &str) {
    let (_, run) = build_in_secret(options, secrets);
    let events = events_of(&run);
    assert_eq!(run.code, Some(0), "{case}: {}", run.stderr);
    assert!(ran(&events).len() > 5, "{case}: {events:#?}");
    let [warning] = warnings(&events)[..] else { panic!("{case}: {:?}", warnings(&events)) };
    println!("{case}: {warning}");
    assert!(warning.contains(advice), "{case}: {warning}");
    assert!(warning.ends_with("; the build continues without it"), "{case}: {warning}");
    let (_, run) = build_in_secret(&[options, &["--remote-required"]].concat(), secrets);
    assert_eq!(run.code, Some(4), "{case}: {} {}", run.stdout, run.stderr);
    assert!(run.stderr.contains(advice), "{case}: {}", run.stderr);
}

#[test]
fn an_encrypted_cache_is_used_if_its_authority_is_trusted() {
    const TEST: &str = "an_encrypted_cache_is_used";
    let (Some(authority), Some(other)) = (Authority::new(TEST), Authority::new(TEST)) else { return };
    let access = Access { tls: Some(&authority), ..Access::default() };
    let Some(server) = BuildGrid::start(TEST, access) else { return };
    let (address, trust) = (server.address("grpcs"), authority.trust());
    let (here, there) = (Project::small(), Project::small());
    let (first, events) = built(&here, &[&address, &trust]);
    assert_eq!(warnings(&events), [""; 0]);
    let (second, _) = built(&there, &[&address, &trust]);
    assert_eq!((&second["ran"], &second["shared"]), (&0.into(), &first["ran"]), "{second}");
    assert_same(&there.outputs(), &here.outputs(), 0);

    let advice = "--tls-certificate";
    is_refused("another authority", &[&address, &other.trust()], &[], advice);
    is_refused("the system's authorities", &[&address], &[], advice);
    is_refused("not encrypted", &[&server.address("grpc")], &[], "begins with grpcs://");
    let Some(plain) = Server::start(TEST) else { return };
    let plain = format!("--remote-cache=grpcs://localhost:{}", plain.port());
    is_refused("encrypted, the server not", &[&plain, &trust], &[], "begins with grpc://");
}

#[test]
fn a_cache_that_wants_certificates_and_tokens_is_used_with_them() {
    const TEST: &str = "a_cache_that_wants_certificates_and_tokens";
    const SECRET: &str = "of-the-studio";
    let (Some(authority), Some(other)) = (Authority::new(TEST), Authority::new(TEST)) else { return };
    let access = Access { tls: Some(&authority), needs_certificate: true, secret: Some(SECRET) };
    let Some(server) = BuildGrid::start(TEST, access) else { return };
    let (address, trust, client) = (server.address("grpcs"), authority.trust(), authority.client());
    let header = |token: &str| format!("--remote-header=authorization=Bearer {token}");
    let token = authority.token(SECRET, 3600);
    let right = [&*address, &*trust, &*client[0], &*client[1]];

    let (here, run) = build_in_secret(&[&right[..], &[&header(&token)]].concat(), &[&token]);
    let first = events_of(&run);
    assert_eq!((run.code, warnings(&first)), (Some(0), vec![]), "{}", run.stderr);
    let (there, run) = build_in_secret(&[&right[..], &[&header(&token)]].concat(), &[&token]);
    let second = events_of(&run);
    assert_eq!((ran(&second).len(), warnings(&second)), (0, vec![]), "{}", run.stdout);
    assert_same(&there.outputs(), &here.outputs(), 0);
    // The same from specula.toml, whose file of headers is the only one that has the token.
    let configured = Project::small();
    let paths = ["authority.pem", "client.pem", "client.key"].map(|name| authority.file(name));
    configured.write("headers", &format!("authorization=Bearer {token}\n"));
    configured.write(
        "specula.toml",
        &format!(
            "[remote]\ncache = {:?}\nheader-file = \"headers\"\ntls-certificate = {:?}\n\
             tls-client-certificate = {:?}\ntls-client-key = {:?}\n",
            address.trim_start_matches("--remote-cache="),
            paths[0],
            paths[1],
            paths[2]
        ),
    );
    let (third, events) = built(&configured, &[]);
    assert_eq!((&third["ran"], warnings(&events)), (&0.into(), vec![]), "{third}");

    let wrong = [
        ("a token that another signed", Some(authority.token("of-another-studio", 3600))),
        ("an expired token", Some(authority.token(SECRET, -3600))),
        ("something else than a token", Some("1234-secret".to_owned())),
        ("no token", None),
    ];
    for (case, token) in wrong {
        let headers = token.iter().map(|token| header(token)).collect::<Vec<_>>();
        let options = right.iter().copied().chain(headers.iter().map(String::as_str)).collect::<Vec<_>>();
        is_refused(case, &options, &token.iter().map(String::as_str).collect::<Vec<_>>(), "--remote-header");
    }
    let header = header(&token);
    let advice = "--tls-client-certificate";
    is_refused("no certificate", &[&address, &trust, &header], &[&token], advice);
    let of_other = other.client();
    let options = [&*address, &*trust, &*of_other[0], &*of_other[1], &*header];
    is_refused("a certificate of another authority", &options, &[&token], advice);
}

/// A server that has room for a part of a build only: it forgets what it stored first, or refuses to store.
#[test]
fn a_server_with_little_room_costs_no_result() {
    const TEST: &str = "a_server_with_little_room";
    let clean = Project::small();
    clean.ok(&["build"]);
    let expected = clean.outputs();
    for more in [&[][..], &["--protect-session-blobs"]] {
        let options = ["--quota-high=40K", "--reserved=1M"].iter().chain(more);
        let Some(server) = Server::with(TEST, options.map(|option| (*option).to_owned()).collect()) else {
            return;
        };
        for round in 0..3 {
            let project = Project::small();
            let (summary, events) = built(&project, &[&server.address()]);
            assert_eq!(summary["failed"], 0, "{summary}");
            assert_same(&project.outputs(), &expected, round);
            println!(
                "{more:?}, build {round}: {} ran, {} shared, {} bytes sent, {} bytes in the server, {:?}",
                summary["ran"],
                summary["shared"],
                summary["shared_traffic"]["sent"],
                server
                    .blobs()
                    .iter()
                    .map(|blob| std::fs::metadata(blob).map_or(0, |data| data.len()))
                    .sum::<u64>(),
                warnings(&events)
            );
            assert!(warnings(&events).len() <= 1, "{:?}", warnings(&events));
        }
    }
}

/// The proxy of a site forwards to the server of the studio.
#[test]
fn results_come_through_the_proxy_of_a_site() {
    const TEST: &str = "results_come_through_the_proxy";
    let Some(studio) = Server::start(TEST) else { return };
    let forward = || vec![format!("--remote=http://127.0.0.1:{}", studio.port())];
    let (Some(site), Some(other)) = (Server::with(TEST, forward()), Server::with(TEST, forward())) else {
        return;
    };
    // What is stored through a proxy is found by all.
    let projects = [(); 4].map(|()| Project::small());
    let (first, events) = built(&projects[0], &[&site.address()]);
    assert_eq!(warnings(&events), [""; 0]);
    for (project, server) in projects[1..].iter().zip([&site, &studio, &other]) {
        let (next, events) = built(project, &[&server.address()]);
        assert_eq!((&next["ran"], &next["shared"]), (&0.into(), &first["ran"]), "{next}");
        assert_eq!(warnings(&events), [""; 0]);
        assert_same(&project.outputs(), &projects[0].outputs(), 0);
    }
}

#[test]
fn items_run_through_the_proxy_of_a_site() {
    const TEST: &str = "items_run_through_the_proxy";
    let Some(studio) = Server::with_workers(TEST) else { return };
    let forward = vec![format!("--remote=http://127.0.0.1:{}", studio.port())];
    let Some(site) = Server::with(TEST, forward) else { return };
    let (here, there) = (Project::small(), Project::small());
    here.ok(&["build"]);
    let [executor, program] = site.executor();
    let (summary, events) = built(&there, &[&executor, &program]);
    assert_eq!((&summary["ran_elsewhere"], warnings(&events)), (&summary["ran"], vec![]), "{summary}");
    assert_same(&there.outputs(), &here.outputs(), 0);
}
