//! French.

use radiosity::bake::BakeError;
use radiosity::patches::SubdivideError;
use radiosity::solve::SolveError;

use super::{Language, Named, Texts};
use crate::action::Action;
use crate::quantities::{Quantity, Unit};

pub(super) const TEXTS: Texts = Texts {
    action,
    quantity,
    unit: |unit| match unit {
        Unit::Light => "dans l’unité de CE",
        Unit::Area => "unité² de la scène",
        Unit::None => "sans unité",
    },
    bake_error,

    menu_file: "Fichier",
    menu_recent: "Ouvrir un fichier récent",
    no_recent: "Aucun",
    menu_radiosity: "Radiosité",
    menu_method: "Méthode",
    menu_precision: "Précision de l’hémicube",
    menu_subdivision: "Subdivision",
    menu_view: "Affichage",
    menu_show: "Montrer",
    menu_exposure: "Exposition",
    menu_tone: "Courbe de tons",
    menu_panels: "Panneaux",
    menu_language: "Langue",
    menu_help: "Aide",
    stop: "Arrêter",
    resume: "Reprendre",

    welcome: "Ouvrez une scène",
    welcome_how: "Déposez ici une scène (.scn, .obj, .gltf, .glb), ou appuyez sur Ctrl+O.\nPuis, bouton droit : Radiosité (Gauss-Seidel).",
    ready: |patches| format!("{patches} pièces. Bouton droit : Radiosité (Gauss-Seidel)."),
    reading: |file| format!("Lecture de {file}"),
    rows: |done, total| format!("Facteurs de forme : {done} lignes sur {total}"),
    sweeps: |done, residual| format!("Gauss-Seidel : itération {done}, résidu {residual}"),
    shots: |done, residual, rows, total| {
        format!("Propagation : tir {done}, non propagé {residual}, {rows} lignes sur {total}")
    },
    looks: |done, total| format!("Estimation de l’erreur : {done} regards sur {total}"),
    correction: |done, total| format!("Correction : {done} points de vue sur {total}"),
    left: |time| format!("encore {time}"),
    paused: "Arrêté ; Espace pour reprendre",
    done: |patches, sweeps, time| {
        format!(
            "{patches} pièces, {sweeps} {}, {time}",
            if sweeps == "1" { "itération" } else { "itérations" }
        )
    },
    done_shots: |patches, shots, time| format!("{patches} pièces, {shots} tirs, {time}"),
    within: |percent| format!("à {percent} % près"),
    seconds: |number| format!("{number} s"),

    trouble_scene: "Cette scène ne peut pas être ouverte",
    trouble_kept: "La dernière bonne scène est conservée.",
    trouble_solve: "La radiosité ne peut pas être calculée",
    trouble_bug: "C’est une faute du programme, non de la scène ; merci de la signaler",
    trouble_save: "L’enregistrement a échoué",
    what_to_do: "Que faire",
    close: "Fermer",
    cancel: "Annuler",
    ok: "OK",
    warnings: "Avertissements",
    saved: |file| format!("Enregistré : {file}"),
    saving: "Enregistrement",
    not_solved: "Il n’y a pas encore de solution : bouton droit, puis Radiosité (Gauss-Seidel).",
    no_scene: "Il n’y a pas encore de scène : appuyez sur Ctrl+O.",

    panel_display: "Ce qui est montré",
    panel_materials: "Lumières et matériaux",
    panel_patch: "Pièce",
    panel_hemicube: "Hémicube",
    panel_residual: "Résidu",

    quantity_label: "Grandeur",
    colour_map: "Couleurs",
    colour_map_name: |name| match name {
        "grey" => "gris",
        other => other,
    },
    logarithmic: "Logarithmique",
    fixed_range: "Bornes fixes",
    from: "de",
    to: "à",
    exposure: "Exposition",
    stops: "IL",
    tone: "Courbe de tons",
    back_faces: "Faces arrière",
    back_faces_lit: "éclairées",
    back_faces_black: "noires",
    back_faces_marked: "marquées",
    back_faces_hidden: "cachées",
    field_of_view: "Angle de vue",
    only_false_colours: "Cette grandeur est un nombre : elle est montrée en fausses couleurs.",

    click_a_patch: "Cliquez sur une surface.",
    patch: "Pièce",
    object: "Objet",
    place: "Dans le fichier",
    line_column: |line, column| format!("ligne {line}, colonne {column}"),
    centre: "Centre",
    normal: "Normale",
    area: "Aire",
    row_sum: "Somme de la ligne",
    unknown: "pas encore connue",
    sees_most: "Voit surtout",
    sees_nothing: "Ne voit rien.",
    seen_from_behind: "vue de dos",

    cells_see: "Ce que voit chaque cellule",
    cells_weigh: "Ce que pèse chaque cellule",
    cell: |patch, weight| format!("pièce {patch}, poids {weight}"),
    cell_empty: |weight| format!("rien, poids {weight}"),

    sweep: "itération",
    round: "tour de tirs",
    residual: "résidu",
    no_residual: "Pas encore de solution.",

    lights: "Lumières",
    surfaces: "Surfaces",
    one_by_one: "Une à une",
    one_by_one_hint: "Lister chaque surface ; sinon les surfaces d’un même matériau vont ensemble",
    on_off: "Allumer ou éteindre cette lumière",
    emission: "Émission",
    intensity: "Intensité : le plus grand canal de l’émission, dans l’unité de CE",
    reflectance: "Réflectance",
    group: |surfaces, _first, place| match surfaces {
        1 => format!("ligne {place}"),
        _ => format!("{surfaces} × ligne {place}…"),
    },

    picture_size: "Taille",
    picture_samples: "Échantillons par pixel",
    as_on_screen: "Comme dans la fenêtre",
    save: "Enregistrer…",
    path_prompt: "Le système n’a pas de dialogue de fichiers. Tapez le chemin :",
    path_hint: "chemin du fichier",
    other_precision: "Précision de l’hémicube",
    other_subdivision: "Facteur de subdivision",
    precision_even: "Un nombre pair de cellules, de 2 à 4096",

    keys: "Touches et souris",
    mouse: &[
        ("Glisser", "tourner autour de la scène"),
        ("Glisser, bouton du milieu ou droit", "déplacer la vue"),
        ("Molette", "approcher, vers le pointeur"),
        ("W A S D, Q E", "voler"),
        ("Clic droit", "le menu de la radiosité"),
        ("Clic", "choisir une pièce"),
    ],
    scenes: "Scènes",
    pictures: "Images",
    solutions: "Solutions",
};

fn action(action: Action) -> Named {
    match action {
        Action::Open => ("Ouvrir…", "Ouvrir un fichier de scène (.scn, .obj, .gltf, .glb)"),
        Action::OpenLast => ("Ouvrir la précédente", "Ouvrir la scène qui était ouverte avant celle-ci"),
        Action::Reload => ("Relire", "Lire le fichier de nouveau ; la caméra reste"),
        Action::SavePicture => {
            ("Enregistrer l’image…", "Enregistrer ce qu’on voit en PNG ou EXR, à toute taille")
        }
        Action::SaveSolution => (
            "Enregistrer la solution…",
            "Une ligne par pièce (CSV, NumPy), un modèle éclairé (glTF) ou une grille (VTK)",
        ),
        Action::Quit => ("Quitter", "Fermer la fenêtre"),
        Action::GaussSeidel => (
            "Radiosité (Gauss-Seidel)",
            "Calculer tous les facteurs de forme, puis itérer jusqu’à ce que plus rien ne change",
        ),
        Action::Progressive => (
            "Radiosité (Propagation)",
            "Propager d’abord la plus grande énergie ; une première image vient aussitôt",
        ),
        Action::StopOrResume => (
            "Arrêter ou reprendre",
            "Arrêter le calcul et garder ce qui est fait ; encore une fois pour reprendre",
        ),
        Action::MethodHemicube => {
            ("Hémicube", "La méthode du devoir : un hémicube de cellules au centre de chaque pièce")
        }
        Action::MethodShares => (
            "Hémicube-exacte",
            "Facteurs exacts, fois la part que voient quatre hémicubes : presque aussi juste que l’exacte",
        ),
        Action::MethodExact => {
            ("Exacte", "Facteurs de forme exacts, à visibilité partielle : plus lents, et bien plus justes")
        }
        Action::Correct => (
            "Corriger l’envoi uniforme",
            "Trouver ce que cachent les pièces qui envoient partout autant, et l’envoyer : exacte, hémicube-exacte",
        ),
        Action::PrecisionQuick => ("30 × 30, rapide", "Un hémicube grossier, pour un premier regard"),
        Action::PrecisionHandIn => ("100 × 100, remise", "La précision demandée par le devoir"),
        Action::PrecisionFine => ("200 × 200, fine", "Quatre fois les cellules de la précision de remise"),
        Action::PrecisionOther => ("Autre précision…", "Tout nombre pair de cellules"),
        Action::SubdivisionHalf => ("× 0,5", "Moitié moins de pièces dans chaque sens"),
        Action::SubdivisionOne => ("× 1, comme écrit", "Autant de pièces que le dit le fichier"),
        Action::SubdivisionTwo => ("× 2", "Deux fois plus de pièces dans chaque sens"),
        Action::SubdivisionOther => ("Autre facteur…", "Tout facteur supérieur à 0"),
        Action::Split => (
            "Diviser où les surfaces se touchent",
            "Les pièces s’arrêtent où un mur se dresse : pas de lumière qui fuit",
        ),
        Action::ResetMaterials => {
            ("Rétablir les matériaux", "L’émission et la réflectance telles que dans le fichier")
        }
        Action::FrameAll => ("Tout cadrer", "Amener toute la scène dans la vue"),
        Action::ResetCamera => ("Rétablir la caméra", "La vue de l’auteur, du .vsn à côté de la scène"),
        Action::Smooth => {
            ("Ombrage lisse", "Fondre la lumière entre les pièces ; sinon chaque pièce montre la sienne")
        }
        Action::Edges => ("Bords des pièces", "Tracer les bords des pièces"),
        Action::Wireframe => ("Fil de fer", "Ne tracer que les bords"),
        Action::Normals => ("Normales", "Tracer la normale de chaque pièce"),
        Action::BackFaces => {
            ("Faces arrière", "Éclairées comme l’avant, noires, marquées ou cachées, tour à tour")
        }
        Action::FalseColours => {
            ("Fausses couleurs", "Montrer les nombres par une échelle de couleurs, avec légende")
        }
        Action::ExposureUp => ("Plus clair", "Augmenter l’exposition d’un tiers d’IL"),
        Action::ExposureDown => ("Plus sombre", "Diminuer l’exposition d’un tiers d’IL"),
        Action::AutoExposure => ("Exposition automatique", "Trouver l’exposition d’après la solution"),
        Action::ToneNeutral => ("Courbe neutre", "Couleurs vraies, doucement comprimées au-delà du blanc"),
        Action::ToneReinhard => {
            ("Courbe de Reinhard", "Comprimer tout ce qui est clair, par l’opérateur de Reinhard")
        }
        Action::ToneLinear => ("Linéaire, écrêtée", "Ne rien comprimer ; ce qui dépasse le blanc est écrêté"),
        Action::Show(shown) => quantity(shown),
        Action::DisplayPanel => ("Panneau : ce qui est montré", "Grandeur, échelle et exposition"),
        Action::MaterialsPanel => {
            ("Panneau : lumières et matériaux", "Changer l’émission et la réflectance ; la lumière suit")
        }
        Action::PatchPanel => ("Panneau : pièce", "Tous les nombres de la pièce choisie"),
        Action::HemicubePanel => {
            ("Panneau : hémicube", "Ce que voit la pièce choisie, par chaque cellule de son hémicube")
        }
        Action::ResidualPanel => ("Panneau : résidu", "Comment le résidu diminue, itération par itération"),
        Action::English => ("English", "Speak English"),
        Action::French => ("Français", "Parler français"),
        Action::Help => ("Touches et souris", "La liste de toutes les touches"),
    }
}

fn quantity(quantity: Quantity) -> Named {
    match quantity {
        Quantity::Radiosity => ("Radiosité", "B : toute la lumière qui quitte une pièce"),
        Quantity::Irradiance => ("Éclairement", "H : toute la lumière qui arrive sur une pièce"),
        Quantity::Emission => ("Émission", "E : la lumière qu’une pièce émet d’elle-même"),
        Quantity::Reflectance => ("Réflectance", "ρ : la part qu’une pièce renvoie"),
        Quantity::Direct => ("Lumière directe", "E + ρ Σ F E : ce qu’on verrait sans interréflexion"),
        Quantity::Indirect => ("Lumière indirecte", "Ce que l’interréflexion ajoute à la lumière directe"),
        Quantity::Area => ("Aire des pièces", "L’aire de chaque pièce"),
        Quantity::Closure => (
            "Erreur de fermeture",
            "Somme de la ligne − 1 : nulle si la scène est fermée et que rien ne fuit",
        ),
        Quantity::FormFactors => {
            ("Facteurs de forme", "F de la pièce choisie : la part qu’elle envoie à chaque autre")
        }
        Quantity::Error => (
            "Erreur",
            "De combien B peut s’écarter, pour 19 pièces sur 20 ; aussi longue que les facteurs de forme",
        ),
    }
}

fn bake_error(error: &BakeError, language: Language) -> String {
    match error {
        BakeError::Subdivide(SubdivideError::TooMany { patches }) => format!(
            "{} pièces, c’est plus qu’on n’en peut numéroter. Choisissez un facteur de subdivision plus petit.",
            language.number(*patches as f64, 3)
        ),
        BakeError::Subdivide(SubdivideError::BadFactor) => {
            "Le facteur de subdivision doit être un nombre supérieur à 0.".into()
        }
        BakeError::Subdivide(SubdivideError::BadSize) => {
            "La taille des pièces doit être un nombre supérieur à 0.".into()
        }
        BakeError::Subdivide(SubdivideError::TooFew { asked, least }) => format!(
            "La scène ne peut être découpée en {} pièces seulement : il en faut au moins {}.",
            language.count(*asked as usize),
            language.count(*least as usize)
        ),
        BakeError::Subdivide(SubdivideError::BadGrading) => {
            "Les pièces ne peuvent pas être resserrées autant de fois.".into()
        }
        BakeError::Memory { patches, needed_gb, limit_gb } => format!(
            "{} pièces demanderaient environ {} Go, et la limite est de {} Go. Choisissez un facteur de subdivision \
             plus petit.",
            language.count(*patches as usize),
            language.number(*needed_gb, 3),
            language.number(*limit_gb, 3)
        ),
        BakeError::Solve(SolveError::Diverges { iterations, residual, max_reflectance }) => format!(
            "Après {} itérations le résidu est de {} et ne diminue plus : la scène renvoie plus qu’elle ne reçoit. \
             Donnez à chaque surface une réflectance inférieure à 1 ; la plus grande est {}.",
            language.count(*iterations),
            language.number(*residual, 3),
            language.number(*max_reflectance, 4)
        ),
        BakeError::BadRequest(message) => message.clone(),
        other => other.to_string(),
    }
}
