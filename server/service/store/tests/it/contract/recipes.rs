use store::{Change, Page, RecipeFilter, StoreError};

use super::stores;
use crate::common::{first, publish, recipe_version};

#[tokio::test]
async fn versions_follow_each_other_and_never_change() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        catalogue.commit(vec![publish("bracket", 1, Some(12))]).await.unwrap();
        catalogue.commit(vec![publish("bracket", 2, Some(13))]).await.unwrap();
        let recipe = catalogue.recipe("bracket").await.unwrap();
        assert_eq!((recipe.newest, recipe.number, recipe.archived), (2, Some(13), false));
        assert_eq!(catalogue.recipe_version("bracket", 1).await.unwrap(), recipe_version("bracket", 1));

        let again = catalogue.commit(vec![publish("bracket", 1, None)]).await.unwrap_err();
        assert!(matches!(again, StoreError::Exists { kind: "recipe", .. }), "{again}");
        for version in [2, 4] {
            let not_next = catalogue.commit(vec![publish("bracket", version, None)]).await.unwrap_err();
            assert!(matches!(not_next, StoreError::Changed { kind: "recipe", .. }), "{not_next}");
        }
        let nobodys = catalogue.commit(vec![publish("hinge", 2, None)]).await.unwrap_err();
        assert!(matches!(nobodys, StoreError::NotFound { kind: "recipe", .. }), "{nobodys}");
        let missing = catalogue.recipe_version("bracket", 3).await.unwrap_err();
        assert!(matches!(missing, StoreError::NotFound { .. }), "{missing}");

        let all = catalogue.recipe_versions("bracket", &first(9)).await.unwrap().records;
        assert_eq!(all, [recipe_version("bracket", 2), recipe_version("bracket", 1)]);
        let newest = catalogue.recipe_versions("bracket", &first(1)).await.unwrap();
        let rest = Page { before: newest.next, limit: 9 };
        assert_eq!(
            catalogue.recipe_versions("bracket", &rest).await.unwrap().records,
            [recipe_version("bracket", 1)]
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_of_many_concurrent_publishers_of_a_version_succeeds() {
    for fresh in stores().await {
        fresh.store.catalogue.commit(vec![publish("bracket", 1, None)]).await.unwrap();
        let tasks: Vec<_> = (0..8)
            .map(|_| {
                let catalogue = fresh.store.catalogue.clone();
                tokio::spawn(async move { catalogue.commit(vec![publish("bracket", 2, None)]).await.is_ok() })
            })
            .collect();
        let mut n_published = 0;
        for task in tasks {
            n_published += usize::from(task.await.unwrap());
        }
        assert_eq!((n_published, fresh.store.catalogue.recipe("bracket").await.unwrap().newest), (1, 2));
    }
}

#[tokio::test]
async fn a_number_is_unique_among_recipes_that_are_not_archived() {
    for fresh in stores().await {
        let catalogue = &fresh.store.catalogue;
        catalogue.commit(vec![publish("bracket", 1, Some(12)), publish("hinge", 1, None)]).await.unwrap();
        let taken = catalogue.commit(vec![publish("hinge", 2, Some(12))]).await.unwrap_err();
        assert!(taken.to_string().contains("recipe bracket has it"), "{taken}");
        let archive = |id: &str, archived| Change::ArchiveRecipe { id: id.to_owned(), archived };
        catalogue.commit(vec![archive("bracket", true), publish("hinge", 2, Some(12))]).await.unwrap();
        let put_away = catalogue.commit(vec![publish("bracket", 2, Some(14))]).await.unwrap_err();
        assert!(put_away.to_string().ends_with("is archived"), "{put_away}");
        let taken = catalogue.commit(vec![archive("bracket", false)]).await.unwrap_err();
        assert!(matches!(taken, StoreError::Refused { .. }), "{taken}");

        let ids = async |archived, number| {
            let filter = RecipeFilter { archived, number };
            let listed = catalogue.recipes(&filter, &first(9)).await.unwrap().records;
            listed.into_iter().map(|recipe| recipe.id).collect::<Vec<_>>()
        };
        assert_eq!(ids(None, None).await, ["hinge", "bracket"]);
        assert_eq!(ids(Some(false), Some(12)).await, ["hinge"]);
        assert_eq!(ids(Some(true), None).await, ["bracket"]);
        let newest = catalogue.recipes(&RecipeFilter::default(), &first(1)).await.unwrap();
        let rest = Page { before: newest.next, limit: 9 };
        let rest = catalogue.recipes(&RecipeFilter::default(), &rest).await.unwrap().records;
        assert_eq!(rest.iter().map(|recipe| recipe.id.as_str()).collect::<Vec<_>>(), ["bracket"]);
        let nobody = catalogue.commit(vec![archive("lid", true)]).await.unwrap_err();
        assert!(matches!(nobody, StoreError::NotFound { kind: "recipe", .. }));
    }
}
